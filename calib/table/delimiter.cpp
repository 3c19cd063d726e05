// SPDX-License-Identifier: Apache-2.0
#include "calib/table/delimiter.h"

#include <algorithm>
#include <string>

#include "calib/table/layout.h"
#include "calib/table/records.h"

namespace toftwin::table {
namespace {

/// How well a delimiter parts the text: the share of records of the same width, times what its fields look
/// like.
double scoreOf(std::string_view text, char delimiter) {
  const Records records = splitRecords(text, delimiter, 1, kSampledRecords);
  if (records.size() == 0) return 0.0;
  const std::size_t width = commonWidth(records);
  constexpr double kOfNothing = 0.5, kOfText = 0.4, kOfTextWithOthers = 0.05;
  double looks = 0.0, fields = 0.0, alike = 0.0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (records.at(i).size() != width) continue;
    alike += 1.0;
    for (const std::string_view field : records.at(i)) {
      const Look look = lookOf(field);
      const bool has_others = field.find_first_of(",;\t|") != std::string_view::npos;
      looks += isValue(look)           ? 1.0
               : look == Look::Nothing ? kOfNothing
               : has_others            ? kOfTextWithOthers
                                       : kOfText;
      fields += 1.0;
    }
  }
  const auto n = static_cast<double>(records.size());
  const auto layout = layoutOf(records, delimiter, {});
  const bool is_named = layout && layout->header_line && layout->header.size() == width;
  const double share = alike / n, of_width = width > 1 ? 1.0 : 0.5, of_names = is_named ? 1.0 : 0.4;
  // A name that holds another delimiter was not parted.
  const bool holds_others = is_named && std::ranges::any_of(layout->header, [&](const std::string& one) {
                              return one.find_first_of(";\t|") != std::string::npos ||
                                     (width == 1 && one.find(',') != std::string::npos);
                            });
  return share * share * (looks / std::max(fields, 1.0)) * of_width * of_names * (holds_others ? 0.3 : 1.0);
}

}  // namespace

std::optional<SaidDelimiter> saidDelimiter(std::string_view text) {
  const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
  std::string_view line = text.substr(0, end);
  if (line.size() > 2 && line.front() == '"' && line.back() == '"') line = line.substr(1, line.size() - 2);
  if (line.size() < 5 || !(line.starts_with("sep=") || line.starts_with("SEP="))) return std::nullopt;
  const char delimiter = line[4];
  if (std::string_view{",;\t| "}.find(delimiter) == std::string_view::npos) return std::nullopt;
  if (!std::ranges::all_of(line.substr(5), [=](char c) { return c == delimiter || c == ' '; }))
    return std::nullopt;
  return SaidDelimiter{delimiter, end};
}

char likeliestDelimiter(std::string_view text) {
  char best = ',';
  double highest = 0.0;
  for (const char delimiter : {',', ';', '\t', '|', kBlanks, kNoDelimiter}) {
    if (delimiter != kNoDelimiter && text.find(delimiter) == std::string_view::npos) continue;
    const double score = scoreOf(text, delimiter);
    if (score > highest) best = delimiter, highest = score;
  }
  return best;
}

}  // namespace toftwin::table
