// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "sim/meshes/faces.h"
#include "sim/meshes/formats.h"
#include "sim/meshes/ply_header.h"
#include "sim/meshes/text.h"

namespace toftwin::sim::meshes {
namespace {

/// Numbers as words. Line ends count as blanks: some programs wrap rows.
class TextData {
 public:
  explicit TextData(std::string_view rest) : rest_(rest) {}
  std::optional<double> next(PlyType) { return numberOf(takeWord(rest_)); }
  /// Each number takes a digit and a blank, but for the last one.
  [[nodiscard]] bool mayHold(std::uint64_t numbers, std::size_t) const { return numbers <= rest_.size() / 2 + 1; }

 private:
  std::string_view rest_;
};

class BinaryData {
 public:
  BinaryData(std::string_view rest, bool is_big_endian) : rest_(rest), is_big_endian_(is_big_endian) {}

  std::optional<double> next(PlyType type) {
    switch (type) {
      case PlyType::Int8:
        return number<std::int8_t>();
      case PlyType::Uint8:
        return number<std::uint8_t>();
      case PlyType::Int16:
        return number<std::int16_t>();
      case PlyType::Uint16:
        return number<std::uint16_t>();
      case PlyType::Int32:
        return number<std::int32_t>();
      case PlyType::Uint32:
        return number<std::uint32_t>();
      case PlyType::Float32:
        return number<float>();
      case PlyType::Float64:
        break;
    }
    return number<double>();
  }
  [[nodiscard]] bool mayHold(std::uint64_t numbers, std::size_t size_of_each) const {
    return numbers <= rest_.size() / size_of_each;
  }

 private:
  template <class T>
  std::optional<double> number() {
    if (rest_.size() < sizeof(T)) return std::nullopt;
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), rest_.data(), sizeof(T));
    rest_.remove_prefix(sizeof(T));
    if (is_big_endian_ != (std::endian::native == std::endian::big)) std::ranges::reverse(bytes);
    return static_cast<double>(std::bit_cast<T>(bytes));
  }

  std::string_view rest_;
  const bool is_big_endian_;
};

/// Which property means what; −1: none does.
struct VertexRoles {
  int x = -1, y = -1, z = -1, u = -1, v = -1;

  static VertexRoles of(const PlyElement& element) {
    VertexRoles roles;
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      if (property.count) continue;
      const std::string& name = property.name;
      const auto is = [&](std::initializer_list<std::string_view> names, int& role) {
        if (std::ranges::find(names, name) != names.end()) role = static_cast<int>(i);
      };
      is({"x"}, roles.x);
      is({"y"}, roles.y);
      is({"z"}, roles.z);
      is({"s", "u", "texture_u"}, roles.u);
      is({"t", "v", "texture_v"}, roles.v);
    }
    return roles;
  }
};

template <class Data>
class PlyReader {
 public:
  PlyReader(Data data, const PlyHeader& header, const std::filesystem::path& file, const std::stop_token& stop)
      : data_(data), header_(header), file_(file), stop_(stop) {}

  Result<MeshFile> read() {
    for (const PlyElement& element : header_.elements) {
      if (element.properties.empty()) continue;  // its rows have nothing
      std::size_t least = 0;
      for (const PlyProperty& p : element.properties) least += sizeOf(p.count.value_or(p.type));
      const std::uint64_t numbers = element.count > UINT64_MAX / 2'000 ? UINT64_MAX : element.count * element.properties.size();
      if (!data_.mayHold(numbers, std::max<std::size_t>(1, least / element.properties.size())))
        return damaged(file_, fmt::format("it says that it has {} of element \"{}\", for which it is too short: it is cut off "
                                          "or damaged", element.count, element.name.substr(0, 40)));
      if (auto done = readRows(element); !done) return done.error();
    }
    if (!has_vertices_) return damaged(file_, "it has no element \"vertex\"");
    if (places_of_vertices_) faces_.corner_places = faces_.corners;
    return meshOf(std::move(faces_), file_, stop_);
  }

 private:
  Result<> readRows(const PlyElement& element) {
    if (element.name == "vertex") return readVertices(element);
    const bool has_faces = element.name == "face" || element.name == "tristrips";
    for (std::uint64_t row = 0; row < element.count; ++row) {
      if (row % 65'536 == 0 && stop_.stop_requested()) return askedToStop();
      corners_.clear();
      uv_.clear();
      for (const PlyProperty& property : element.properties) {
        const bool is_corners = property.name == "vertex_indices" || property.name == "vertex_index";
        std::vector<double>* list = !has_faces ? nullptr : is_corners ? &corners_ : property.name == "texcoord" ? &uv_ : nullptr;
        if (!readProperty(property, list)) return endedIn(element, row);
      }
      if (!has_faces) continue;
      if (auto added = element.name == "face" ? addFace(row) : addStrips(row); !added) return added;
    }
    return {};
  }

  Result<> readVertices(const PlyElement& element) {
    has_vertices_ = true;
    const VertexRoles roles = VertexRoles::of(element);
    if (roles.x < 0 || roles.y < 0 || roles.z < 0) return damaged(file_, "its vertices have no x, y and z");
    places_of_vertices_ = roles.u >= 0 && roles.v >= 0;
    faces_.vertices.reserve(element.count);
    std::vector<double> row(element.properties.size());
    const auto at = [&](int role) { return row[static_cast<std::size_t>(role)]; };
    for (std::uint64_t i = 0; i < element.count; ++i) {
      if (i % 65'536 == 0 && stop_.stop_requested()) return askedToStop();
      for (std::size_t p = 0; p < row.size(); ++p) {
        const PlyProperty& property = element.properties[p];
        const auto number = property.count ? std::optional{0.0} : data_.next(property.type);
        if (!number || (property.count && !readProperty(property, nullptr))) return endedIn(element, i);
        row[p] = *number;
      }
      faces_.vertices.push_back({at(roles.x), at(roles.y), at(roles.z)});
      if (places_of_vertices_)
        faces_.places.push_back({static_cast<float>(at(roles.u)), static_cast<float>(1.0 - at(roles.v))});
    }
    return {};
  }

  /// Takes one property of a row; a list's numbers go to `list`, if there is one.
  bool readProperty(const PlyProperty& property, std::vector<double>* list) {
    if (!property.count) return data_.next(property.type).has_value();
    const auto count = data_.next(*property.count);
    if (!count || !(*count >= 0.0) || !(*count < 4e9)) return false;
    const auto numbers = static_cast<std::uint64_t>(*count);
    if (!data_.mayHold(numbers, sizeOf(property.type))) return false;
    for (std::uint64_t i = 0; i < numbers; ++i) {
      const auto number = data_.next(property.type);
      if (!number) return false;
      if (list != nullptr) list->push_back(*number);
    }
    return true;
  }

  Result<> addCorner(double number, std::uint64_t row) {
    if (!(number >= 0.0) || number >= Faces::kNone || number != std::floor(number))
      return damaged(file_, fmt::format("face {} refers to vertex {}, but there are {}; mend the file", row, number,
                                        faces_.vertices.size()));
    faces_.corners.push_back(static_cast<std::uint32_t>(number));
    return {};
  }

  /// Places on a picture are of the corners where a face has two numbers for each.
  Result<> addFace(std::uint64_t row) {
    const bool has_places = !corners_.empty() && uv_.size() == 2 * corners_.size();
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (auto added = addCorner(corners_[i], row); !added) return added;
      if (places_of_vertices_) continue;
      if (has_places) {
        faces_.corner_places.resize(faces_.corners.size() - 1, Faces::kNone);
        faces_.corner_places.push_back(static_cast<std::uint32_t>(faces_.places.size()));
        faces_.places.push_back({static_cast<float>(uv_[2 * i]), static_cast<float>(1.0 - uv_[2 * i + 1])});
      } else if (!faces_.corner_places.empty()) {
        faces_.corner_places.push_back(Faces::kNone);
      }
    }
    faces_.ends.push_back(faces_.corners.size());
    return {};
  }

  /// Each corner makes a triangle with the two before it; −1 begins anew.
  Result<> addStrips(std::uint64_t row) {
    std::size_t since = 0;
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      since = corners_[i] == -1.0 ? 0 : since + 1;
      if (since < 3) continue;
      const bool is_odd = since % 2 == 0;
      for (const std::size_t k : {i - (is_odd ? 1 : 2), i - (is_odd ? 2 : 1), i}) {
        if (auto added = addCorner(corners_[k], row); !added) return added;
      }
      faces_.ends.push_back(faces_.corners.size());
    }
    return {};
  }

  [[nodiscard]] Error endedIn(const PlyElement& element, std::uint64_t row) const {
    return damaged(file_, fmt::format("it ends or has no number in row {} of {} of element \"{}\"; it is cut off or damaged", row,
                                      element.count, element.name.substr(0, 40)));
  }

  Data data_;
  const PlyHeader& header_;
  const std::filesystem::path& file_;
  const std::stop_token& stop_;
  bool has_vertices_ = false, places_of_vertices_ = false;
  std::vector<double> corners_, uv_;  ///< of the present row
  Faces faces_;
};

}  // namespace

Result<MeshFile> readPly(std::string_view bytes, const std::filesystem::path& file, const std::stop_token& stop) {
  const auto header = readPlyHeader(bytes, file);
  if (!header) return header.error();
  const std::string_view rest = bytes.substr(header->size);
  if (header->format == PlyHeader::Format::Text) return PlyReader{TextData{rest}, *header, file, stop}.read();
  return PlyReader{BinaryData{rest, header->format == PlyHeader::Format::BigEndian}, *header, file, stop}.read();
}

}  // namespace toftwin::sim::meshes
