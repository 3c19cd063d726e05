// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <string>

#include "sim/meshes/faces.h"
#include "sim/meshes/formats.h"
#include "sim/meshes/text.h"

namespace toftwin::sim::meshes {
namespace {

class ObjReader {
 public:
  ObjReader(std::string_view bytes, const std::filesystem::path& file, const std::stop_token& stop)
      : rest_(bytes), file_(file), stop_(stop) {
    if (rest_.starts_with("\xef\xbb\xbf")) rest_.remove_prefix(3);  // a byte order mark
  }

  Result<MeshFile> read() {
    std::string joined;  // of lines that a backslash continues
    while (!rest_.empty()) {
      if (++line_ % 65'536 == 0 && stop_.stop_requested()) return askedToStop();
      std::string_view line = takeLine(rest_);
      if (line.ends_with('\\')) {
        joined.append(line.substr(0, line.size() - 1)) += ' ';
        continue;
      }
      if (!joined.empty()) line = joined.append(line);
      if (auto taken = take(line); !taken) return taken.error();
      joined.clear();
    }
    if (!joined.empty()) {
      if (auto taken = take(joined); !taken) return taken.error();
    }
    if (places_missing_) faces_.corner_places.clear();
    auto mesh = meshOf(std::move(faces_), file_, stop_);
    if (mesh && curves_ > 0)
      mesh->notes.push_back(fmt::format("{} free-form curves or surfaces are left out; export them as polygons", curves_));
    return mesh;
  }

 private:
  Result<> take(std::string_view line) {
    const std::string_view kind = takeWord(line);
    if (kind == "v") return takeVertex(line);
    if (kind == "vt") return takePlace(line);
    if (kind == "f" || kind == "fo") return takeFace(line);
    if (kind == "curv" || kind == "curv2" || kind == "surf") ++curves_;
    return {};
  }

  /// Behind the place there may be a weight or a colour.
  Result<> takeVertex(std::string_view line) {
    std::array<double, 3> v{};
    for (double& value : v) {
      const std::string_view word = takeWord(line);
      const auto number = numberOf(word);
      if (!number) return wrong(fmt::format("a vertex needs three numbers, but \"{}\" is none", word.substr(0, 40)));
      value = *number;
    }
    faces_.vertices.push_back(vec3Of(v));
    return {};
  }

  /// From the picture's bottom up in the file, from its top down here.
  Result<> takePlace(std::string_view line) {
    const auto u = numberOf(takeWord(line));
    const auto v = numberOf(takeWord(line)).value_or(0.0);
    if (!u) return wrong("a texture coordinate needs a number");
    faces_.places.push_back({static_cast<float>(*u), static_cast<float>(1.0 - v)});
    return {};
  }

  /// Corners as vertex, vertex/place, vertex//normal or vertex/place/normal.
  Result<> takeFace(std::string_view line) {
    for (std::string_view corner = takeWord(line); !corner.empty(); corner = takeWord(line)) {
      const std::size_t slash = corner.find('/');
      const auto vertex = indexOf(corner.substr(0, slash), faces_.vertices.size());
      if (!vertex) return vertex.error();
      std::uint32_t place = Faces::kNone;
      if (slash != corner.npos) {
        const std::string_view behind = corner.substr(slash + 1);
        if (const std::string_view word = behind.substr(0, behind.find('/')); !word.empty()) {
          const auto found = indexOf(word, faces_.places.size());
          if (!found) return found.error();
          place = *found;
        }
      }
      places_missing_ |= place == Faces::kNone;
      faces_.corners.push_back(*vertex);
      faces_.corner_places.push_back(place);
    }
    faces_.ends.push_back(faces_.corners.size());
    return {};
  }

  /// Counted from 1, or backwards from the newest as −1. One that comes later in the file counts, too, so its
  /// upper bound is checked at the end.
  Result<std::uint32_t> indexOf(std::string_view word, std::size_t count) const {
    const auto number = integerOf(word);
    const auto there = static_cast<long long>(count);
    if (!number || *number == 0 || *number >= Faces::kNone || *number < -there) {
      return wrong(fmt::format("\"{}\" is no index: they count from 1, or from -1 backwards, and there are {} so far",
                               word.substr(0, 40), count));
    }
    return static_cast<std::uint32_t>(*number > 0 ? *number - 1 : there + *number);
  }

  [[nodiscard]] Error wrong(std::string_view what) const { return damaged(file_, fmt::format("line {}: {}", line_, what)); }

  std::string_view rest_;
  const std::filesystem::path& file_;
  const std::stop_token& stop_;
  std::size_t line_ = 0, curves_ = 0;
  bool places_missing_ = false;  ///< of a corner
  Faces faces_;
};

}  // namespace

Result<MeshFile> readObj(std::string_view bytes, const std::filesystem::path& file, const std::stop_token& stop) {
  return ObjReader{bytes, file, stop}.read();
}

}  // namespace toftwin::sim::meshes
