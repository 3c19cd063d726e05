// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cstring>

#include "sim/meshes/faces.h"
#include "sim/meshes/formats.h"
#include "sim/meshes/text.h"

namespace toftwin::sim::meshes {
namespace {

constexpr std::size_t kHead = 84, kRecord = 50;  ///< 80 bytes and a count; normal, three corners, two bytes

/// Little end first, as all of a binary STL; so is every computer that this runs on.
template <class T>
T valueAt(std::string_view bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

void addTriangle(Faces& faces) {
  const auto count = static_cast<std::uint32_t>(faces.vertices.size());
  for (std::uint32_t i = 3; i > 0; --i) faces.corners.push_back(count - i);
  faces.ends.push_back(faces.corners.size());
}

Result<Faces> binaryFaces(std::string_view bytes, const std::filesystem::path& file, const std::stop_token& stop) {
  const std::size_t said = valueAt<std::uint32_t>(bytes, 80), there = (bytes.size() - kHead) / kRecord;
  if (said > there) {
    return damaged(file, fmt::format("it says that it has {} triangles, but ends after {}; it is cut off, or no STL",
                                     said, there));
  }
  Faces faces;
  faces.vertices.reserve(3 * said);
  for (std::size_t t = 0; t < said; ++t) {
    if (t % 65'536 == 0 && stop.stop_requested()) return askedToStop();
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::size_t at = kHead + t * kRecord + 12 * (corner + 1);
      const auto number = [&](std::size_t axis) { return static_cast<double>(valueAt<float>(bytes, at + 4 * axis)); };
      faces.vertices.push_back({number(0), number(1), number(2)});
    }
    addTriangle(faces);
  }
  return faces;
}

Result<Vec3d> vertexOf(std::string_view line, std::size_t number, const std::filesystem::path& file) {
  std::array<double, 3> v{};
  for (double& value : v) {
    const std::string_view word = takeWord(line);
    const auto read = numberOf(word);
    if (!read)
      return damaged(file, fmt::format("line {}: a vertex needs three numbers, but \"{}\" is none", number, word.substr(0, 40)));
    value = *read;
  }
  return vec3Of(v);
}

/// `facet`, `outer loop` and their ends carry nothing that three vertices do not.
Result<Faces> textFaces(std::string_view rest, const std::filesystem::path& file, const std::stop_token& stop) {
  Faces faces;
  std::size_t corners = 0, number = 0;
  bool has_end = false;
  while (!rest.empty()) {
    if (++number % 65'536 == 0 && stop.stop_requested()) return askedToStop();
    std::string_view line = takeLine(rest);
    const std::string_view word = takeWord(line);
    has_end = word == "endsolid" || (has_end && word.empty());
    if (word == "endloop" && corners != 3)
      return damaged(file, fmt::format("line {}: a triangle has {} corners", number, corners));
    if (word == "endloop") addTriangle(faces);
    if (word == "endloop" || word == "outer") corners = 0;
    if (word != "vertex") continue;
    const auto vertex = vertexOf(line, number, file);
    if (!vertex) return vertex.error();
    faces.vertices.push_back(*vertex);
    ++corners;
  }
  if (!has_end) return damaged(file, "it ends without \"endsolid\": it is cut off, or no STL");
  return faces;
}

}  // namespace

/// A binary file may begin with "solid" all the same: then its size fits its count.
Result<MeshFile> readStl(std::string_view bytes, const std::filesystem::path& file, const std::stop_token& stop) {
  const bool is_exact =
      bytes.size() >= kHead && bytes.size() == kHead + kRecord * std::size_t{valueAt<std::uint32_t>(bytes, 80)};
  std::string_view start = bytes.substr(0, 512);
  const bool is_text = !is_exact && takeWord(start) == "solid";
  if (!is_text && bytes.size() < kHead) return damaged(file, "it is too short for an STL");
  auto faces = is_text ? textFaces(bytes, file, stop) : binaryFaces(bytes, file, stop);
  if (!faces) return faces.error();
  return meshOf(*std::move(faces), file, stop);
}

}  // namespace toftwin::sim::meshes
