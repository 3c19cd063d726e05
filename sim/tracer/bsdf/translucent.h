// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/tracer/bsdf/bsdf.h"

namespace toftwin::sim::bsdf {

/// Wax, skin, foam, paper: diffuse, `through` of what it gives back on the other side, and all of it after
/// a way within the material. That way is exponentially distributed, of mean length c τ:
///   P ↦ P / (1 + iωτ)      (the tracer's sign: a delay turns phases backwards)
/// is what a phasor becomes on average. Where the light leaves is not moved.
struct Translucent {
  double through = 0.0;
  double mean_length_m = 0.0;  ///< c τ
  static constexpr bool kIsDelta = false;

  [[nodiscard]] double value(double albedo, Vec3d from, Vec3d to) const {
    if (from.z <= 0.0 || to.z == 0.0) return 0.0;
    return albedo / std::numbers::pi * (to.z > 0.0 ? 1.0 - through : through);
  }
  [[nodiscard]] double density(double, Vec3d, Vec3d to) const {
    return std::abs(to.z) / std::numbers::pi * (to.z > 0.0 ? 1.0 - through : through);
  }
  [[nodiscard]] bool goesThrough(double choice) const { return choice < through; }
  [[nodiscard]] double wayWithin(double draw) const { return -mean_length_m * std::log1p(-draw); }
  [[nodiscard]] Scattered sample(double albedo, Vec3d from, Draw draw) const {
    Vec3d to = cosineDirection(draw.u, draw.v);
    if (goesThrough(draw.choice)) to.z = -to.z;
    return {to, from.z > 0.0 ? albedo : 0.0, density(albedo, from, to), 0.0};
  }
};

}  // namespace toftwin::sim::bsdf
