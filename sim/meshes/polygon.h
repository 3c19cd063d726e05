// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <toftwin/geometry.h>

namespace toftwin::sim::meshes {

/// Splits polygons into triangles. All polygons of a file share a budget of work, because what clipping ears
/// costs grows with the square of the corners, or faster for polygons that were made to be hard.
class PolygonSplitter {
 public:
  static constexpr std::uint64_t kWork = 200'000'000;  ///< comparisons of a corner with a triangle: under a second

  using Triangle = std::array<std::uint32_t, 3>;

  /// The triangles of a polygon, as numbers of its corners; the polygon may have notches, but should be flat
  /// and not cross itself: then its area is kept. One that does cross itself gives as many triangles, somehow.
  /// Good until the next call; empty if the budget is used up or there are fewer than three corners.
  /// Ears: G. H. Meisters, "Polygons have ears", 1975.
  std::span<const Triangle> split(std::span<const Vec3d> corners);
  [[nodiscard]] bool isExhausted() const { return work_ == 0; }

 private:
  struct Point {
    double x, y;
  };
  bool fan();
  void clipEars();
  bool isEar(std::uint32_t before, std::uint32_t at, std::uint32_t after);
  void cut(std::uint32_t at);
  [[nodiscard]] double turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;

  std::uint64_t work_ = kWork;
  std::vector<Point> flat_;  ///< the corners in the polygon's plane, turning left
  std::vector<std::uint32_t> previous_, next_;
  std::vector<Triangle> triangles_;
};

}  // namespace toftwin::sim::meshes
