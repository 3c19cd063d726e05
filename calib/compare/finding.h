// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/compare/json.h"
#include "calib/compare/report.h"

namespace toftwin::compare {

/// One part of a report with its numbers.
struct Finding {
  Section section;
  std::vector<Card> cards{};
  std::string headline{};            ///< a clause for the report's verdict, or empty
  std::vector<std::string> notes{};  ///< what a reader must know; in the section, too
  Json data = Json::object();
};

}  // namespace toftwin::compare
