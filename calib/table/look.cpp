// SPDX-License-Identifier: Apache-2.0
#include "calib/table/look.h"

#include "calib/table/number.h"
#include "calib/table/stamp.h"

namespace toftwin::table {

Look lookOf(std::string_view field) {
  if (saysNothing(field)) return Look::Nothing;
  if (signsOf(field) != Signs::NoNumber) return Look::Number;
  const bool may_be_time = field.find_first_of(":/.- hms") != std::string_view::npos &&
                           field.find_first_of("0123456789") != std::string_view::npos;
  return may_be_time && stampIn(field) ? Look::Time : Look::Text;
}

}  // namespace toftwin::table
