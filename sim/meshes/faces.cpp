// SPDX-License-Identifier: Apache-2.0
#include "sim/meshes/faces.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/meshes/polygon.h"

namespace toftwin::sim::meshes {
namespace {

/// Beyond it squares and cross products of single-precision numbers would no longer be finite.
constexpr double kMostCoordinate = 1e12;
constexpr std::size_t kStopStride = 65'536;  ///< faces between two looks at the stop token

/// Faces become triangles; what there was is counted.
class Splitting {
 public:
  Splitting(const Faces& faces, const std::filesystem::path& file) : faces_(faces), file_(file) {
    mesh_.triangles.reserve(faces.ends.size());
  }

  Result<> run(const std::stop_token& stop) {
    std::uint64_t begin = 0;
    for (std::size_t f = 0; f < faces_.ends.size(); ++f) {
      if (f % kStopStride == 0 && stop.stop_requested()) return askedToStop();
      const std::uint64_t end = faces_.ends[f];
      if (auto added = add(f, begin, end); !added) return added;
      begin = end;
    }
    return {};
  }

  [[nodiscard]] std::size_t tooShort() const { return too_short_; }
  TriangleMesh take() { return std::move(mesh_); }

 private:
  Result<> add(std::size_t face, std::uint64_t begin, std::uint64_t end) {
    corners_.clear();
    for (std::uint64_t i = begin; i < end; ++i) {
      const std::uint32_t vertex = faces_.corners[i];
      if (vertex >= faces_.vertices.size()) {
        return damaged(file_, fmt::format("face {} refers to vertex {}, but there are {}; mend the file", face, vertex,
                                          faces_.vertices.size()));
      }
      corners_.push_back(faces_.vertices[vertex]);
    }
    if (corners_.size() < 3) {
      ++too_short_;
      return {};
    }
    const auto triangles = splitter_.split(corners_);
    if (splitter_.isExhausted()) {
      return damaged(file_, fmt::format("face {} of {} corners, or those before it, take too long to split into "
                                        "triangles; triangulate them in the program that wrote them",
                                        face, corners_.size()));
    }
    for (const auto& [a, b, c] : triangles) {
      mesh_.triangles.push_back({faces_.corners[begin + a], faces_.corners[begin + b], faces_.corners[begin + c]});
      if (!faces_.corner_places.empty()) mesh_.places.push_back({placeOf(begin + a), placeOf(begin + b), placeOf(begin + c)});
    }
    return {};
  }

  /// Where one corner has no place on a picture, none of the mesh counts.
  TexturePlace placeOf(std::uint64_t corner) {
    const std::uint32_t place = faces_.corner_places[corner];
    return place < faces_.places.size() ? faces_.places[place] : TexturePlace{NAN, NAN};
  }

  const Faces& faces_;
  const std::filesystem::path& file_;
  PolygonSplitter splitter_;
  std::vector<Vec3d> corners_;
  TriangleMesh mesh_;
  std::size_t too_short_ = 0;
};

bool areFinite(const std::array<TexturePlace, 3>& places) {
  return std::ranges::all_of(places, [](TexturePlace at) { return std::isfinite(at.u) && std::isfinite(at.v); });
}

}  // namespace

Error damaged(const std::filesystem::path& file, std::string_view what) {
  return {Error::Code::Malformed, fmt::format("mesh {}: {}", file.string(), what)};
}

Error askedToStop() { return {Error::Code::Stopped, "asked to stop while reading a mesh"}; }

Result<> checkVertices(const std::vector<Vec3d>& vertices, const std::filesystem::path& file) {
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Vec3d& v = vertices[i];
    if (std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z)) {
      if (std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}) <= kMostCoordinate) continue;
      return Error{Error::Code::InvalidArgument,
                   fmt::format("mesh {}: vertex {} is at ({}, {}, {}), and {} is as far as can be; mend the file",
                               file.string(), i, v.x, v.y, v.z, kMostCoordinate)};
    }
    return Error{Error::Code::InvalidArgument, fmt::format("mesh {}: vertex {} is not finite ({}, {}, {}); mend the file",
                                                           file.string(), i, v.x, v.y, v.z)};
  }
  return {};
}

Result<> leaveOutFlat(MeshFile& read, const std::filesystem::path& file) {
  TriangleMesh& mesh = read.mesh;
  const std::size_t before = mesh.triangles.size();
  const bool has_places = mesh.places.size() == before;
  std::size_t kept = 0;
  const auto keep = [&](std::size_t from) {
    const auto& [a, b, c] = mesh.triangles[from];
    const Vec3d& p = mesh.vertices[a];
    if (!(norm(cross(mesh.vertices[b] - p, mesh.vertices[c] - p)) > 0.0)) return;
    mesh.triangles[kept] = mesh.triangles[from];
    if (has_places) mesh.places[kept] = mesh.places[from];
    ++kept;
  };
  for (Part& part : read.parts) {
    const std::size_t first = kept;
    for (std::size_t i = part.first; i < part.first + part.count; ++i) keep(i);
    part.first = first;
    part.count = kept - first;
  }
  if (kept == 0) {
    return Error{Error::Code::InvalidArgument,
                 before == 0 ? fmt::format("mesh {}: it has no triangles", file.string())
                             : fmt::format("mesh {}: none of its {} triangles has an area", file.string(), before)};
  }
  mesh.triangles.resize(kept);
  if (has_places) mesh.places.resize(kept);
  std::erase_if(read.parts, [](const Part& part) { return part.count == 0; });
  if (kept < before)
    read.notes.push_back(fmt::format("{} of {} triangles have no area and are left out", before - kept, before));
  return {};
}

Result<MeshFile> meshOf(Faces faces, const std::filesystem::path& file, const std::stop_token& stop) {
  if (auto finite = checkVertices(faces.vertices, file); !finite) return finite.error();
  if (faces.ends.empty()) {
    return Error{Error::Code::InvalidArgument,
                 faces.vertices.empty()
                     ? fmt::format("mesh {}: it has neither vertices nor faces", file.string())
                     : fmt::format("mesh {}: it has {} points, but no faces; a surface is needed", file.string(),
                                   faces.vertices.size())};
  }
  Splitting splitting{faces, file};
  if (auto split = splitting.run(stop); !split) return split.error();
  MeshFile read;
  read.mesh = splitting.take();
  if (!std::ranges::all_of(read.mesh.places, areFinite)) read.mesh.places.clear();
  read.mesh.vertices = std::move(faces.vertices);
  read.parts = {{"", 0, read.mesh.triangles.size(), std::nullopt}};
  if (splitting.tooShort() > 0) {
    read.notes.push_back(fmt::format("{} of {} faces have fewer than three corners and are left out",
                                     splitting.tooShort(), faces.ends.size()));
  }
  if (read.mesh.triangles.empty()) return damaged(file, fmt::format("no face has three corners, of {}", faces.ends.size()));
  if (auto left = leaveOutFlat(read, file); !left) return left.error();
  return read;
}

}  // namespace toftwin::sim::meshes
