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

std::vector<CaptureEvidence> joined(std::vector<CaptureEvidence> captures, const std::vector<std::size_t>& unit) {
  std::vector<CaptureEvidence> all;
  for (std::size_t c = 0; c < captures.size(); ++c) {
    if (unit[c] == all.size()) {
      all.push_back(std::move(captures[c]));
      continue;
    }
    CaptureEvidence& one = all[unit[c]];
    one.gram += captures[c].gram, one.moment += captures[c].moment;
    one.energy += captures[c].energy, one.rows += captures[c].rows;
  }
  return all;
}

}  // namespace toftwin::discover
