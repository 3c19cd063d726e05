// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <limits>

#include <toftwin/geometry.h>

#include "sim/tracer/texture.h"

namespace toftwin::sim {

/// A sphere, a disc or a closed cylinder, intersected in double precision: the surface is exact, not
/// made of facets. Its own frame: centre at the origin, axis along z.
struct Quadric {
  enum class Kind { Sphere, Disc, Cylinder };
  /// Which smooth surface of the quadric; cylinders have three.
  enum Part : int { kWhole = 0, kSide = 0, kTop = 1, kBottom = 2 };

  Kind kind = Kind::Sphere;
  double radius = 1.0;
  double half_height = 0.0;
  Vec3d centre;               ///< in the scene's frame
  std::array<Vec3d, 3> axes;  ///< x, y, z of its own frame in the scene's frame

  [[nodiscard]] Vec3d toLocal(Vec3d v) const { return {dot(v, axes[0]), dot(v, axes[1]), dot(v, axes[2])}; }
  [[nodiscard]] Vec3d toScene(Vec3d v) const { return axes[0] * v.x + axes[1] * v.y + axes[2] * v.z; }
};

/// Distances along a unit direction at which the ray's line crosses a part; NaN where it does not.
struct Crossings {
  double first = std::numeric_limits<double>::quiet_NaN();
  double second = std::numeric_limits<double>::quiet_NaN();
};

/// Ray in the quadric's own frame.
inline Crossings crossings(const Quadric& quadric, int part, Vec3d o, Vec3d d) {
  const double r2 = quadric.radius * quadric.radius;
  // Solves a t² + 2 b t + c = 0 without cancellation.
  const auto solve = [](double a, double b, double c) -> Crossings {
    const double discriminant = b * b - a * c;
    if (!(discriminant >= 0.0) || a == 0.0) return {};
    const double q = -(b + std::copysign(std::sqrt(discriminant), b));
    if (q == 0.0) return {0.0, 0.0};
    const double t0 = q / a, t1 = c / q;
    return t0 < t1 ? Crossings{t0, t1} : Crossings{t1, t0};
  };
  const auto plane = [&](double z) -> Crossings {
    const double t = (z - o.z) / d.z;
    const double x = o.x + t * d.x, y = o.y + t * d.y;
    if (!(x * x + y * y <= r2)) return {};
    return {.first = t};
  };
  if (quadric.kind == Quadric::Kind::Sphere) return solve(dot(d, d), dot(o, d), dot(o, o) - r2);
  if (quadric.kind == Quadric::Kind::Disc) return plane(0.0);
  if (part == Quadric::kTop) return plane(quadric.half_height);
  if (part == Quadric::kBottom) return plane(-quadric.half_height);
  Crossings side = solve(d.x * d.x + d.y * d.y, o.x * d.x + o.y * d.y, o.x * o.x + o.y * o.y - r2);
  const auto keep = [&](double& t) {
    if (!(std::abs(o.z + t * d.z) <= quadric.half_height)) t = std::numeric_limits<double>::quiet_NaN();
  };
  keep(side.first);
  keep(side.second);
  return side;
}

/// A place on the part, moved onto it exactly, and the outward unit normal; in the quadric's own frame.
struct SurfacePoint {
  Vec3d position, normal;
};
inline SurfacePoint ontoSurface(const Quadric& quadric, int part, Vec3d p) {
  if (quadric.kind == Quadric::Kind::Sphere) {
    const Vec3d n = normalised(p);
    return {n * quadric.radius, n};
  }
  if (quadric.kind == Quadric::Kind::Disc) return {{p.x, p.y, 0.0}, {0.0, 0.0, 1.0}};
  if (part == Quadric::kTop) return {{p.x, p.y, quadric.half_height}, {0.0, 0.0, 1.0}};
  if (part == Quadric::kBottom) return {{p.x, p.y, -quadric.half_height}, {0.0, 0.0, -1.0}};
  const Vec3d n = normalised(Vec3d{p.x, p.y, 0.0});
  return {{n.x * quadric.radius, n.y * quadric.radius, p.z}, n};
}

/// Where a place on the part lies on a picture. Spheres and cylinders: once round from −y over −x, upright with z
/// up; discs and ends: the square around them.
inline TexturePlace texturePlaceOn(const Quadric& quadric, int part, Vec3d p) {
  constexpr double kTurn = 6.283185307179586;
  const double r = quadric.radius;
  const double round = 0.5 + std::atan2(p.x, p.y) / kTurn;
  const auto placed = [](double u, double v) { return TexturePlace{static_cast<float>(u), static_cast<float>(v)}; };
  if (quadric.kind == Quadric::Kind::Sphere) return placed(round, 2.0 * std::acos(std::fmax(-1.0, std::fmin(1.0, p.z / r))) / kTurn);
  const bool is_side = quadric.kind == Quadric::Kind::Cylinder && part == Quadric::kSide;
  if (is_side) return placed(round, 0.5 - p.z / (2.0 * quadric.half_height));
  return placed(0.5 + p.x / (2.0 * r), 0.5 + p.y / (2.0 * r));
}

}  // namespace toftwin::sim
