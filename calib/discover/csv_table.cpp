// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/csv_table.h"

#include <algorithm>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>

#include <fmt/format.h>

namespace toftwin::discover {
namespace {

constexpr std::size_t kMostColumns = 400, kMostRows = 1'000'000;

Error malformed(const std::filesystem::path& name, std::size_t line, std::string_view what) {
  return {Error::Code::Malformed, fmt::format("{}:{}: {}", name.string(), line, what)};
}

std::string trimmed(std::string_view text) {
  const auto isBlank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && isBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && isBlank(text.back())) text.remove_suffix(1);
  return std::string{text};
}

char separatorOf(std::string_view header) {
  char best = ',';
  for (const char candidate : {',', ';', '\t'})
    if (std::ranges::count(header, candidate) > std::ranges::count(header, best)) best = candidate;
  return best;
}

/// Nothing where a quote is never closed.
std::optional<std::vector<std::string>> fieldsOf(std::string_view line, char separator) {
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

Result<> takeHeader(CsvTable& table, const std::filesystem::path& name, std::size_t line) {
  if (table.header.size() > kMostColumns)
    return malformed(name, line,
                     fmt::format("has {} columns, more than {}", table.header.size(), kMostColumns));
  std::set<std::string> seen;
  for (std::size_t i = 0; i < table.header.size(); ++i) {
    if (table.header[i].empty()) return malformed(name, line, fmt::format("column {} has no header", i + 1));
    if (!seen.insert(table.header[i]).second)
      return malformed(name, line, fmt::format("two columns are called \"{}\"", table.header[i]));
  }
  table.columns.resize(table.header.size());
  return {};
}

}  // namespace

Result<CsvTable> parseCsv(std::string_view text, const std::filesystem::path& name) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (text.find('\0') != std::string_view::npos)
    return malformed(name, 1, "holds zero bytes: this is no text table");
  CsvTable table;
  char separator = ',';
  std::size_t number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    ++number;
    if (trimmed(line).empty() || line.front() == '#') continue;
    if (table.header.empty()) table.separator = separator = separatorOf(line);
    auto fields = fieldsOf(line, separator);
    if (!fields) return malformed(name, number, "a quote is opened and not closed on the same line");
    if (table.header.empty()) {
      table.header = *std::move(fields);
      if (auto taken = takeHeader(table, name, number); !taken) return taken.error();
      continue;
    }
    if (fields->size() != table.header.size()) {
      return malformed(
          name, number,
          fmt::format("has {} fields, but the header has {}", fields->size(), table.header.size()));
    }
    if (table.rows() == kMostRows) return malformed(name, number, "is beyond a million rows: thin the table");
    for (std::size_t i = 0; i < fields->size(); ++i) table.columns[i].push_back(std::move((*fields)[i]));
    table.line.push_back(number);
  }
  if (table.header.empty()) return malformed(name, 1, "is empty: a line of headers and rows are needed");
  if (table.rows() == 0) return malformed(name, number, "has a header but no rows");
  return table;
}

Result<CsvTable> loadCsv(const std::filesystem::path& file) {
  std::error_code ignored;
  std::ifstream in{file, std::ios::binary};
  if (!in || std::filesystem::is_directory(file, ignored))
    return Error{Error::Code::NotFound, fmt::format("{}: cannot be read", file.string())};
  std::ostringstream text;
  text << in.rdbuf();
  return parseCsv(text.str(), file);
}

}  // namespace toftwin::discover
