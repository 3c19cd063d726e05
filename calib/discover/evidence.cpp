// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/evidence.h"

#include <algorithm>

namespace toftwin::discover {

std::string_view nameOf(Stage stage) {
  switch (stage) {
    case Stage::Light:
      return "light";
    case Stage::Samples:
      return "samples";
    case Stage::Range:
      break;
  }
  return "range";
}

std::size_t Evidence::columns() const {
  std::size_t end = 0;
  for (const Group& group : groups) end = std::max(end, group.first + group.count);
  return end;
}

const Group* Evidence::find(std::string_view name) const {
  const auto found = std::ranges::find_if(groups, [&](const Group& group) { return group.name == name; });
  return found == groups.end() ? nullptr : &*found;
}

}  // namespace toftwin::discover
