// SPDX-License-Identifier: Apache-2.0
#include "sim/meshes/ply_header.h"

#include <fmt/format.h>

#include <map>

#include "sim/meshes/faces.h"
#include "sim/meshes/text.h"

namespace toftwin::sim::meshes {
namespace {

constexpr std::size_t kMostProperties = 1'000;  ///< of all elements

std::optional<PlyType> typeOf(std::string_view word) {
  using enum PlyType;
  static const std::map<std::string_view, PlyType> kTypes{
      {"char", Int8},    {"int8", Int8},   {"uchar", Uint8},    {"uint8", Uint8},     {"short", Int16},
      {"int16", Int16},  {"ushort", Uint16}, {"uint16", Uint16}, {"int", Int32},       {"int32", Int32},
      {"uint", Uint32},  {"uint32", Uint32}, {"float", Float32}, {"float32", Float32}, {"double", Float64},
      {"float64", Float64}};
  const auto found = kTypes.find(word);
  return found == kTypes.end() ? std::nullopt : std::optional{found->second};
}

class HeaderReader {
 public:
  HeaderReader(std::string_view bytes, const std::filesystem::path& file) : rest_(bytes), size_(bytes.size()), file_(file) {}

  /// The first line shows what ends lines. Data may begin with a byte that looks like a line's end, so that only
  /// this one may be taken behind "end_header".
  Result<PlyHeader> read() {
    const std::size_t end = rest_.find_first_of("\r\n");
    if (end == rest_.npos || rest_.substr(0, end) != "ply") return wrong("it does not begin with \"ply\"");
    line_end_ = rest_[end] == '\r' && end + 1 < rest_.size() && rest_[end + 1] == '\n' ? "\r\n" : rest_.substr(end, 1);
    rest_.remove_prefix(end + line_end_.size());
    while (true) {
      const std::size_t stop = rest_.find(line_end_);
      if (stop == rest_.npos) return wrong("its header has no \"end_header\"");
      std::string_view line = rest_.substr(0, stop);
      rest_.remove_prefix(stop + line_end_.size());
      const std::string_view word = takeWord(line);
      if (word == "end_header") break;
      if (auto taken = take(word, line); !taken) return taken.error();
    }
    if (!has_format_) return wrong("its header names no format");
    header_.size = size_ - rest_.size();
    return std::move(header_);
  }

 private:
  Result<> take(std::string_view word, std::string_view line) {
    if (word == "format") return takeFormat(line);
    if (word == "element") return takeElement(line);
    if (word == "property") return takeProperty(line);
    if (word == "comment" || word == "obj_info" || word.empty()) return {};
    return wrong(fmt::format("its header has a line \"{} …\", which PLY has not", word.substr(0, 40)));
  }

  Result<> takeFormat(std::string_view line) {
    const std::string_view name = takeWord(line);
    using enum PlyHeader::Format;
    if (name != "ascii" && name != "binary_little_endian" && name != "binary_big_endian")
      return wrong(fmt::format("its format \"{}\" is not known", name.substr(0, 40)));
    header_.format = name == "ascii" ? Text : name == "binary_little_endian" ? LittleEndian : BigEndian;
    has_format_ = true;
    return {};
  }

  Result<> takeElement(std::string_view line) {
    const std::string_view name = takeWord(line), word = takeWord(line);
    const auto count = integerOf(word);
    if (!count || *count < 0) return wrong(fmt::format("element \"{}\" has no count, but \"{}\"", name.substr(0, 40), word.substr(0, 40)));
    header_.elements.push_back({std::string{name}, static_cast<std::uint64_t>(*count), {}});
    return countOne();
  }

  Result<> takeProperty(std::string_view line) {
    if (header_.elements.empty()) return wrong("its header has a property before the first element");
    PlyProperty property;
    std::string_view type = takeWord(line);
    if (type == "list") {
      property.count = typeOf(takeWord(line));
      if (!property.count) return wrong("its header has a list whose count has no known type");
      type = takeWord(line);
    }
    const auto known = typeOf(type);
    if (!known) return wrong(fmt::format("its header has a property of unknown type \"{}\"", type.substr(0, 40)));
    property.type = *known;
    property.name = takeWord(line);
    header_.elements.back().properties.push_back(std::move(property));
    return countOne();
  }

  Result<> countOne() {
    if (++named_ > kMostProperties) return wrong(fmt::format("its header has more than {} properties", kMostProperties));
    return {};
  }

  [[nodiscard]] Error wrong(std::string_view what) const { return damaged(file_, fmt::format("{}; it is damaged, or no PLY", what)); }

  std::string_view rest_, line_end_;
  const std::size_t size_;
  const std::filesystem::path& file_;
  PlyHeader header_;
  bool has_format_ = false;
  std::size_t named_ = 0;
};

}  // namespace

std::size_t sizeOf(PlyType type) {
  switch (type) {
    case PlyType::Int8:
    case PlyType::Uint8:
      return 1;
    case PlyType::Int16:
    case PlyType::Uint16:
      return 2;
    case PlyType::Int32:
    case PlyType::Uint32:
    case PlyType::Float32:
      return 4;
    case PlyType::Float64:
      break;
  }
  return 8;
}

Result<PlyHeader> readPlyHeader(std::string_view bytes, const std::filesystem::path& file) {
  return HeaderReader{bytes, file}.read();
}

}  // namespace toftwin::sim::meshes
