// SPDX-License-Identifier: Apache-2.0
#include "calib/table/column_names.h"

#include <algorithm>

#include "calib/table/look.h"
#include "calib/table/records.h"

namespace toftwin::table {

std::vector<std::string> namesInComment(std::string_view comment, std::size_t width, char delimiter) {
  for (const char one : {delimiter, ',', ';', '\t', '|', kBlanks}) {
    const Records parts = splitRecords(comment, one);
    if (parts.size() != 1 || parts.at(0).size() != width) continue;
    const bool are_names = std::ranges::all_of(parts.at(0), [](std::string_view field) {
      return lookOf(field) == Look::Text || lookOf(field) == Look::Nothing;
    });
    const bool has_name =
        std::ranges::any_of(parts.at(0), [](std::string_view field) { return !field.empty(); });
    if (are_names && has_name) return {parts.at(0).begin(), parts.at(0).end()};
  }
  return {};
}

std::vector<std::string> namesAtWideGaps(std::string_view line, std::size_t width) {
  std::vector<std::string> names;
  for (line = trimmed(line); !line.empty() && names.size() <= width;) {
    const std::size_t gap = std::min(line.find("  "), line.size());
    names.emplace_back(trimmed(line.substr(0, gap)));
    line = trimmed(line.substr(gap));
  }
  return names.size() == width ? names : std::vector<std::string>{};
}

}  // namespace toftwin::table
