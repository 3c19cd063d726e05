// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/csv.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "calib/compare/csv_fields.h"

namespace toftwin::compare {
namespace {

std::optional<double> toNumber(std::string_view field) {
  double number = 0.0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), number);
  if (error != std::errc{} || end != field.data() + field.size()) return std::nullopt;
  return number;
}

void dropByteOrderMark(std::string& line) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (line.starts_with(kByteOrderMark)) line.erase(0, kByteOrderMark.size());
}

Error malformed(const std::filesystem::path& file, std::size_t line, std::string_view what) {
  return {Error::Code::Malformed, fmt::format("{}:{}: {}", file.string(), line, what)};
}

/// A file whose first line is read, and what follows is not.
struct HeadedFile {
  std::ifstream rest{};
  std::string header{};
};

Result<HeadedFile> openHeaded(const std::filesystem::path& file) {
  HeadedFile opened{.rest = std::ifstream{file}};
  if (!opened.rest || !std::getline(opened.rest, opened.header)) {
    return Error{Error::Code::NotFound,
                 fmt::format("{}: cannot be read or is empty", file.string())};
  }
  dropByteOrderMark(opened.header);
  return opened;
}

Result<std::vector<std::string>> fieldsOf(std::string_view line, const std::filesystem::path& file,
                                          std::size_t number) {
  auto fields = csvFields(line, ',');
  if (!fields) return malformed(file, number, kOpenQuote);
  return *std::move(fields);
}

Result<std::vector<std::vector<double>>> columnsOf(HeadedFile& opened, const std::filesystem::path& file,
                                                   std::initializer_list<std::string_view> columns) {
  std::vector<std::size_t> places;
  const auto header = fieldsOf(opened.header, file, 1);
  if (!header) return header.error();
  for (const std::string_view column : columns) {
    const auto at = std::find(header->begin(), header->end(), column);
    if (at == header->end() && header->size() == 1 && opened.header.find_first_of(";\t") != std::string::npos) {
      return malformed(file, 1,
                       fmt::format("its fields are separated by {}: it takes commas between them, and points in "
                                   "numbers",
                                   opened.header.find(';') == std::string::npos ? "tabs" : "semicolons"));
    }
    if (at == header->end()) {
      return malformed(file, 1, fmt::format("has no column \"{}\", only: {}", column, opened.header));
    }
    if (std::find(at + 1, header->end(), column) != header->end())
      return malformed(file, 1, fmt::format("has two columns \"{}\"", column));
    places.push_back(static_cast<std::size_t>(at - header->begin()));
  }
  std::vector<std::vector<double>> result(columns.size());
  std::string line;
  for (std::size_t number = 2; std::getline(opened.rest, line); ++number) {
    if (line.empty() || line == "\r") continue;
    const auto fields = fieldsOf(line, file, number);
    if (!fields) return fields.error();
    if (fields->size() != header->size())
      return malformed(file, number, otherFieldCount(fields->size(), header->size(), ','));
    for (std::size_t i = 0; i < places.size(); ++i) {
      const std::string& field = (*fields)[places[i]];
      const auto value = toNumber(field);
      if (!value) return malformed(file, number, fmt::format("\"{}\" is not a number", field));
      result[i].push_back(*value);
    }
  }
  if (result.front().empty()) return malformed(file, 2, "has a header but no rows");
  return result;
}

}  // namespace

Result<std::vector<std::vector<double>>> loadColumns(
    const std::filesystem::path& file, std::initializer_list<std::string_view> columns) {
  auto opened = openHeaded(file);
  if (!opened) return opened.error();
  return columnsOf(*opened, file, columns);
}

Result<std::optional<std::vector<double>>> loadColumnIfAny(const std::filesystem::path& file,
                                                           std::string_view column) {
  auto opened = openHeaded(file);
  if (!opened) return opened.error();
  const auto header = fieldsOf(opened->header, file, 1);
  if (!header) return header.error();
  if (std::ranges::count(*header, column) == 0) return std::optional<std::vector<double>>{};
  auto columns = columnsOf(*opened, file, {column});
  if (!columns) return columns.error();
  return std::optional{std::move(columns->front())};
}

std::optional<std::filesystem::path> findThesisData(const std::filesystem::path& given) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const auto inside = [&](const fs::path& folder) -> std::optional<fs::path> {
    for (const fs::path& candidate : {folder / "tof-thesis-2018", folder}) {
      if (fs::is_directory(candidate / "corner", ignored)) return candidate;
    }
    return std::nullopt;
  };
  if (!given.empty()) return inside(given);
  if (const char* named = std::getenv("TOFTWIN_DATA"); named != nullptr && *named != '\0') {
    return inside(named);
  }
  for (fs::path folder :
       {fs::current_path(ignored), fs::read_symlink("/proc/self/exe", ignored).parent_path()}) {
    for (; folder.has_relative_path(); folder = folder.parent_path()) {
      if (!fs::exists(folder / ".git", ignored)) continue;
      if (auto found = inside(folder.parent_path() / "shared" / "data")) return found;
    }
  }
  return std::nullopt;
}

}  // namespace toftwin::compare
