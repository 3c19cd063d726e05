// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/csv_table.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>

#include <fmt/format.h>

#include "calib/compare/csv_fields.h"

namespace toftwin::discover {
namespace {

constexpr std::size_t kMostColumns = 400, kMostRows = 1'000'000;

Error malformed(const std::filesystem::path& name, std::size_t line, std::string_view what) {
  return {Error::Code::Malformed, fmt::format("{}:{}: {}", name.string(), line, what)};
}

/// Whether all bytes are UTF-8 as RFC 3629 has it.
bool isUtf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const std::size_t more = byte < 0x80                   ? 0
                             : byte >= 0xC2 && byte < 0xE0 ? 1
                             : byte >= 0xE0 && byte < 0xF0 ? 2
                             : byte >= 0xF0 && byte < 0xF5 ? 3
                                                           : 4;
    if (more == 4 || i + more >= text.size()) return false;
    for (std::size_t k = 1; k <= more; ++k)
      if ((static_cast<unsigned char>(text[i + k]) & 0xC0U) != 0x80U) return false;
    const auto second = more == 0 ? 0U : static_cast<unsigned char>(text[i + 1]);
    const bool is_overlong = (byte == 0xE0 && second < 0xA0) || (byte == 0xF0 && second < 0x90);
    if (is_overlong || (byte == 0xED && second > 0x9F) || (byte == 0xF4 && second > 0x8F)) return false;
    i += more + 1;
  }
  return true;
}

/// Windows-1252, as WHATWG's Encoding Standard has it: the five bytes that mean nothing are the controls of
/// Latin-1.
std::string fromWindows1252(std::string_view text) {
  constexpr std::array<unsigned, 32> kHigh{0x20AC, 0x81,   0x201A, 0x0192, 0x201E, 0x2026, 0x2020, 0x2021,
                                           0x02C6, 0x2030, 0x0160, 0x2039, 0x0152, 0x8D,   0x017D, 0x8F,
                                           0x90,   0x2018, 0x2019, 0x201C, 0x201D, 0x2022, 0x2013, 0x2014,
                                           0x02DC, 0x2122, 0x0161, 0x203A, 0x0153, 0x9D,   0x017E, 0x0178};
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const unsigned point = byte >= 0x80 && byte < 0xA0 ? kHigh[byte - 0x80U] : byte;
    if (point < 0x80) {
      out += static_cast<char>(point);
    } else if (point < 0x800) {
      out += static_cast<char>(0xC0U | point >> 6U), out += static_cast<char>(0x80U | (point & 0x3FU));
    } else {
      out += static_cast<char>(0xE0U | point >> 12U), out += static_cast<char>(0x80U | (point >> 6U & 0x3FU));
      out += static_cast<char>(0x80U | (point & 0x3FU));
    }
  }
  return out;
}

/// Excel's first line: "sep=;".
std::optional<char> saidSeparator(std::string_view line) {
  const std::string text =
      line.find('\t') == std::string_view::npos ? compare::trimmed(line) : std::string{line.substr(0, 5)};
  if (text.size() != 5 || !text.starts_with("sep=")) return std::nullopt;
  return text[4] == ',' || text[4] == ';' || text[4] == '\t' ? std::optional{text[4]} : std::nullopt;
}

char separatorOf(std::string_view header) {
  char best = ',';
  for (const char candidate : {',', ';', '\t'})
    if (std::ranges::count(header, candidate) > std::ranges::count(header, best)) best = candidate;
  return best;
}

Result<> takeHeader(CsvTable& table, const std::filesystem::path& name, std::size_t line) {
  if (table.header.size() > kMostColumns)
    return malformed(name, line,
                     fmt::format("has {} columns, more than {}", table.header.size(), kMostColumns));
  if (table.header.size() == 1)
    return malformed(name, line, fmt::format("no comma, semicolon or tab parts \"{}\" into columns; blanks do not",
                                             table.header[0].substr(0, 60)));
  std::set<std::string> seen;
  for (std::size_t i = 0; i < table.header.size(); ++i) {
    if (table.header[i].empty()) return malformed(name, line, fmt::format("column {} has no header: name it", i + 1));
    if (!seen.insert(table.header[i]).second)
      return malformed(name, line, fmt::format("two columns are called \"{}\": rename one", table.header[i]));
  }
  table.columns.resize(table.header.size());
  return {};
}

}  // namespace

static Result<CsvTable> parseUtf8(std::string_view text, const std::filesystem::path& name) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (text.find('\0') != std::string_view::npos)
    return malformed(name, 1, "holds zero bytes: this is no text table");
  CsvTable table;
  char separator = ',';
  std::optional<char> said;
  std::size_t number = 0;
  const char line_end = text.find('\n') == std::string_view::npos ? '\r' : '\n';  // of old Macs: CR alone
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(line_end), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    ++number;
    if (compare::trimmed(line).empty() || line.front() == '#') continue;
    if (number == 1 && (said = saidSeparator(line))) continue;
    if (table.header.empty()) table.separator = separator = said.value_or(separatorOf(line));
    auto fields = compare::csvFields(line, separator);
    if (!fields) return malformed(name, number, compare::kOpenQuote);
    if (table.header.empty()) {
      table.header = *std::move(fields);
      if (auto taken = takeHeader(table, name, number); !taken) return taken.error();
      continue;
    }
    if (fields->size() != table.header.size()) {
      return malformed(name, number,
                       compare::otherFieldCount(fields->size(), table.header.size(), separator));
    }
    if (table.rows() == kMostRows) return malformed(name, number, "is beyond a million rows: thin the table");
    for (std::size_t i = 0; i < fields->size(); ++i) table.columns[i].push_back(std::move((*fields)[i]));
    table.line.push_back(number);
  }
  if (table.header.empty()) return malformed(name, 1, "is empty: a line of headers and rows are needed");
  if (table.rows() == 0) return malformed(name, number, "has a header but no rows");
  return table;
}

Result<CsvTable> parseCsv(std::string_view text, const std::filesystem::path& name) {
  if (isUtf8(text)) return parseUtf8(text, name);
  auto table = parseUtf8(fromWindows1252(text), name);
  if (table) table->is_from_windows = true;
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
