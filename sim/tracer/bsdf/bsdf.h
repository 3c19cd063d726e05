// SPDX-License-Identifier: Apache-2.0
// What every reflection model shares. A model is an aggregate with four functions:
//
//   double value(double albedo, Vec3d from, Vec3d to)     f, 1/sr; 0 for a delta
//   double density(double albedo, Vec3d from, Vec3d to)   of sample(), 1/sr; 0 for a delta
//   Scattered sample(double albedo, Vec3d from, Draw)     a direction by that density
//   static constexpr bool kIsDelta                        all of its light goes in single directions
//
// Directions are unit vectors that leave the surface, in its own frame: z is the normal on the side that
// `from` is on. Paths are traced from the camera: `from` looks back towards the camera, `to` on towards
// the light. All models are reciprocal, f(from, to) = f(to, from), and give back no more than they got.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <toftwin/geometry.h>

namespace toftwin::sim::bsdf {

/// Random numbers in [0, 1) for one scattering.
struct Draw {
  double u, v;    ///< the direction
  double choice;  ///< which of several ways
};

struct Scattered {
  Vec3d to;
  double weight = 0.0;   ///< f |cos θ| / density: what the path's throughput is multiplied with; 0: absorbed
  double density = 0.0;  ///< 1/sr; infinite for a delta
  double extra_m = 0.0;  ///< optical path length within the material
};

inline constexpr double kDelta = std::numeric_limits<double>::infinity();

/// Density cos θ / π over the upper half space.
inline Vec3d cosineDirection(double u, double v) {
  const double r = std::sqrt(u), phi = 2.0 * std::numbers::pi * v;
  return {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(1e-12, 1.0 - u))};
}
inline double cosineDensity(Vec3d to) { return to.z > 0.0 ? to.z / std::numbers::pi : 0.0; }

/// Share of unpolarised light that a smooth boundary to a medium `index` times as dense reflects [Fresnel].
inline double dielectricFresnel(double cosine, double index) {
  const double inner2 = 1.0 - (1.0 - cosine * cosine) / (index * index);
  if (inner2 <= 0.0) return 1.0;  // total reflection, for an index below 1
  const double inner = std::sqrt(inner2);
  const double across = (cosine - index * inner) / (cosine + index * inner);
  const double along = (index * cosine - inner) / (index * cosine + inner);
  return 0.5 * (across * across + along * along);
}

/// Schlick's approximation for metals, from the reflectance at normal incidence.
inline double metalFresnel(double cosine, double normal_reflectance) {
  const double c = std::clamp(1.0 - cosine, 0.0, 1.0);
  return normal_reflectance + (1.0 - normal_reflectance) * (c * c) * (c * c) * c;
}

}  // namespace toftwin::sim::bsdf
