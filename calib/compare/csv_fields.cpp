// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/csv_fields.h"

#include <utility>

#include <fmt/format.h>

#include "protocol/types/counted.h"

namespace toftwin::compare {

std::string trimmed(std::string_view text) {
  const auto isBlank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && isBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && isBlank(text.back())) text.remove_suffix(1);
  return std::string{text};
}

std::optional<std::vector<std::string>> csvFields(std::string_view line, char separator) {
  std::vector<std::string> fields;
  std::string field;
  bool is_quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && is_quoted && i + 1 < line.size() && line[i + 1] == '"') {
      field += '"', ++i;
    } else if (c == '"') {
      is_quoted = !is_quoted;
    } else if (c == separator && !is_quoted) {
      fields.push_back(trimmed(field)), field.clear();
    } else {
      field += c;
    }
  }
  if (is_quoted) return std::nullopt;
  fields.push_back(trimmed(field));
  return fields;
}

std::string otherFieldCount(std::size_t fields, std::size_t header, char separator) {
  std::string words = fmt::format("has {}, but the header has {}", counted(fields, "field"), header);
  if (fields > header && separator == ',') {
    words +=
        "; commas in its numbers may be why, decimal ones or between thousands: write 1500.25 for 1500,25 and for "
        "1,500.25, and quote texts that hold commas";
  }
  return words;
}

}  // namespace toftwin::compare
