// SPDX-License-Identifier: Apache-2.0
#include "sim/meshes/polygon.h"

#include <cmath>

namespace toftwin::sim::meshes {
namespace {

/// Normal of a polygon, as long as twice its area, by the sum over its edges (Newell's). Coordinates count
/// from the first corner, so that a polygon far from the origin keeps its digits.
Vec3d normalOf(std::span<const Vec3d> corners) {
  Vec3d sum{};
  for (std::size_t i = 1; i + 1 < corners.size(); ++i)
    sum = sum + cross(corners[i] - corners[0], corners[i + 1] - corners[0]);
  return sum;
}

}  // namespace

std::span<const PolygonSplitter::Triangle> PolygonSplitter::split(std::span<const Vec3d> corners) {
  triangles_.clear();
  if (corners.size() < 3) return {};
  if (corners.size() == 3) {
    triangles_.push_back({0, 1, 2});
    return triangles_;
  }
  const Vec3d normal = normalOf(corners);
  const double nx = std::abs(normal.x), ny = std::abs(normal.y), nz = std::abs(normal.z);
  flat_.clear();
  for (const Vec3d& corner : corners) {
    const Vec3d p = corner - corners[0];
    if (nx >= ny && nx >= nz)
      flat_.push_back(normal.x >= 0 ? Point{p.y, p.z} : Point{p.z, p.y});
    else if (ny >= nz)
      flat_.push_back(normal.y >= 0 ? Point{p.z, p.x} : Point{p.x, p.z});
    else
      flat_.push_back(normal.z >= 0 ? Point{p.x, p.y} : Point{p.y, p.x});
  }
  if (!fan()) clipEars();
  return triangles_;
}

/// Twice the signed area of a triangle: positive if it turns left.
double PolygonSplitter::turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
  return (flat_[b].x - flat_[a].x) * (flat_[c].y - flat_[a].y) -
         (flat_[b].y - flat_[a].y) * (flat_[c].x - flat_[a].x);
}

/// Triangles around the first corner, if that sees all others.
bool PolygonSplitter::fan() {
  const auto count = static_cast<std::uint32_t>(flat_.size());
  for (std::uint32_t i = 1; i + 1 < count; ++i) {
    if (!(turn(0, i, i + 1) > 0.0)) return false;
  }
  for (std::uint32_t i = 1; i + 1 < count; ++i) triangles_.push_back({0, i, i + 1});
  return true;
}

/// A corner that turns left, and whose triangle holds no other corner. Corners at the triangle's own corners
/// do not count: a bridge to a hole goes there and back.
bool PolygonSplitter::isEar(std::uint32_t before, std::uint32_t at, std::uint32_t after) {
  if (!(turn(before, at, after) > 0.0)) return false;
  const auto isAt = [&](std::uint32_t a, std::uint32_t b) { return flat_[a].x == flat_[b].x && flat_[a].y == flat_[b].y; };
  for (std::uint32_t i = next_[after]; i != before && work_ > 0; i = next_[i]) {
    --work_;
    if (turn(before, at, i) < 0.0 || turn(at, after, i) < 0.0 || turn(after, before, i) < 0.0) continue;
    if (!isAt(i, before) && !isAt(i, at) && !isAt(i, after)) return false;
  }
  return true;
}

void PolygonSplitter::cut(std::uint32_t at) {
  triangles_.push_back({previous_[at], at, next_[at]});
  next_[previous_[at]] = next_[at];
  previous_[next_[at]] = previous_[at];
}

/// Where no corner is an ear, the polygon crosses itself or is flat to a line: the next corner is cut then.
void PolygonSplitter::clipEars() {
  const auto count = static_cast<std::uint32_t>(flat_.size());
  previous_.resize(count);
  next_.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    previous_[i] = (i + count - 1) % count;
    next_[i] = (i + 1) % count;
  }
  std::uint32_t at = 0, passed = 0;
  for (std::uint32_t left = count; left > 3 && work_ > 0;) {
    --work_;
    if (passed < left && !isEar(previous_[at], at, next_[at])) {
      at = next_[at];
      ++passed;
      continue;
    }
    cut(at);
    at = next_[next_[at]];  // not the neighbour: triangles stay wide
    passed = 0;
    --left;
  }
  triangles_.push_back({previous_[at], at, next_[at]});
  if (work_ == 0) triangles_.clear();
}

}  // namespace toftwin::sim::meshes
