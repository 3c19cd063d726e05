// SPDX-License-Identifier: Apache-2.0
// PLY [Turk, The PLY Polygon File Format, 1994], as far as it is points.
#include <fmt/format.h>

#include <array>
#include <sstream>

#include "tools/cli/import/cloud/cloud_file.h"

namespace toftwin::cli {
namespace {

Error malformed(const std::string& file, std::string_view what) { return {Error::Code::Malformed, fmt::format("{}: {}", file, what)}; }

struct TypeRow {
  std::string_view name, other_name;
  std::uint8_t number;  ///< PointField's
  std::uint32_t size;
};
constexpr std::array kTypes{TypeRow{"char", "int8", 1, 1},    TypeRow{"uchar", "uint8", 2, 1},  TypeRow{"short", "int16", 3, 2},   TypeRow{"ushort", "uint16", 4, 2},
                            TypeRow{"int", "int32", 5, 4},    TypeRow{"uint", "uint32", 6, 4},  TypeRow{"float", "float32", 7, 4}, TypeRow{"double", "float64", 8, 8}};

struct Head {
  std::string format;
  std::vector<ros::PointField> fields;
  std::uint32_t point_bytes = 0;
  std::uint64_t points = 0, columns = 0, rows = 0;
  std::size_t begin = 0;
};

Result<> takeLine(const std::string& line, Head& head, bool& is_vertex, const std::string& file) {
  std::istringstream words{line};
  std::string word, type, name;
  words >> word;
  if (word == "format") words >> head.format;
  if (word == "obj_info") {
    std::uint64_t number = 0;
    words >> name >> number;
    if (name == "num_cols") head.columns = number;
    if (name == "num_rows") head.rows = number;
  }
  if (word == "element") {
    words >> name;
    is_vertex = name == "vertex";
    if (is_vertex) words >> head.points;
    else if (head.points == 0) return malformed(file, "its vertices do not come first");
  }
  if (word != "property" || !is_vertex) return {};
  words >> type >> name;
  for (const TypeRow& row : kTypes) {
    if (row.name != type && row.other_name != type) continue;
    head.fields.push_back({name == "amplitude" ? "intensity" : name, head.point_bytes, row.number, 1});
    head.point_bytes += row.size;
    return {};
  }
  return malformed(file, fmt::format("its vertices have a property of the type \"{}\"", type.substr(0, 40)));
}

Result<Head> readHead(const std::string& text, const std::string& file) {
  Head head;
  bool is_vertex = false;
  for (std::string line; line != "end_header";) {
    const std::size_t end = text.find('\n', head.begin);
    if (end == text.npos || end > 65'536) return malformed(file, "its header does not end");
    line = text.substr(head.begin, end - head.begin);
    if (!line.empty() && line.back() == '\r') line.pop_back();
    head.begin = end + 1;
    if (auto taken = takeLine(line, head, is_vertex, file); !taken) return taken.error();
  }
  constexpr std::uint64_t kMost = 1u << 26;
  if (head.fields.empty() || head.fields.size() > 256 || head.points == 0 || head.points > kMost) return malformed(file, "it has no points, or too many");
  const bool has_grid = head.columns > 0 && head.columns <= kMost && head.rows <= kMost && head.columns * head.rows == head.points;
  if (!has_grid) head.columns = head.points, head.rows = 1;
  return head;
}

}  // namespace

Result<CloudFile> readPly(const std::filesystem::path& path) {
  const std::string file = path.string();
  const auto text = readCloudText(path);
  if (!text) return text.error();
  auto head = readHead(*text, file);
  if (!head) return head.error();
  const std::string_view rest = std::string_view{*text}.substr(head->begin);
  CloudFile read;
  if (head->format == "ascii") {
    auto numbers = pointsOfText(rest, head->points, head->fields.size(), file);
    if (!numbers) return numbers.error();
    read.bytes = *std::move(numbers);
    for (std::size_t i = 0; i < head->fields.size(); ++i) head->fields[i].offset = static_cast<std::uint32_t>(8 * i), head->fields[i].datatype = 8;
    head->point_bytes = static_cast<std::uint32_t>(8 * head->fields.size());
  } else if (head->format == "binary_little_endian") {
    const std::size_t size = head->points * head->point_bytes;
    if (rest.size() < size) return malformed(file, "it ends before its points do");
    const auto bytes = std::as_bytes(std::span{rest}).first(size);
    read.bytes.assign(bytes.begin(), bytes.end());
  } else {
    return malformed(file, fmt::format("points in the format \"{}\" are not read; ascii and binary_little_endian are", head->format.substr(0, 40)));
  }
  read.cloud.fields = std::move(head->fields);
  read.cloud.width = static_cast<std::uint32_t>(head->columns);
  read.cloud.height = static_cast<std::uint32_t>(head->rows);
  read.cloud.point_step = head->point_bytes;
  read.cloud.row_step = read.cloud.point_step * read.cloud.width;
  read.cloud.data = read.bytes;
  return read;
}

}  // namespace toftwin::cli
