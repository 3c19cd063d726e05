// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/tracer/bsdf/bsdf.h"

namespace toftwin::sim::bsdf {

/// Lambertian, or the qualitative model of Oren & Nayar (1994, eq. 30):
///   f = albedo/π · (A + B · max(0, cos Δφ) · sin α · tan β)
///   A = 1 − σ²/(2 (σ² + 0.33)),  B = 0.45 σ²/(σ² + 0.09),  σ in radians
/// with α the larger and β the smaller of the two angles to the normal; Lambertian is A = 1, B = 0.
struct Diffuse {
  double a = 1.0, b = 0.0;
  static constexpr bool kIsDelta = false;

  static Diffuse rough(double sigma_rad) {
    const double sigma2 = sigma_rad * sigma_rad;
    return {1.0 - sigma2 / (2.0 * (sigma2 + 0.33)), 0.45 * sigma2 / (sigma2 + 0.09)};
  }
  [[nodiscard]] double value(double albedo, Vec3d from, Vec3d to) const {
    if (from.z <= 0.0 || to.z <= 0.0) return 0.0;
    // sin α sin β cos Δφ; tan β divides by the larger cosine.
    const double sines = std::max(0.0, from.x * to.x + from.y * to.y);
    return albedo / std::numbers::pi * (a + b * sines / std::max(from.z, to.z));
  }
  [[nodiscard]] double density(double, Vec3d, Vec3d to) const { return cosineDensity(to); }
  [[nodiscard]] Scattered sample(double albedo, Vec3d from, Draw draw) const {
    const Vec3d to = cosineDirection(draw.u, draw.v);
    return {to, value(albedo, from, to) * std::numbers::pi, cosineDensity(to), 0.0};
  }
};

}  // namespace toftwin::sim::bsdf
