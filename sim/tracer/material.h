// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/tracer/scene_file.h"

namespace toftwin::sim {

/// A material as the tracer uses it. Reflection relative to a Lambertian surface of the same albedo:
///   f_r = albedo/π · (A + B · max(0, cos Δφ) · sin α · tan β)         [Oren & Nayar 1994, eq. 30]
///   A = 1 − σ²/(2 (σ² + 0.33)),  B = 0.45 σ²/(σ² + 0.09),  σ in radians
/// with α the larger and β the smaller of the two angles to the normal; Lambertian is A = 1, B = 0.
struct Material {
  float albedo = 0.5f;
  float emission = 0.0f;
  float a = 1.0f;
  float b = 0.0f;
};

inline Material materialOf(const MaterialSpec& spec) {
  Material material{.albedo = static_cast<float>(spec.albedo),
                    .emission = static_cast<float>(spec.emission)};
  if (spec.model == Reflection::OrenNayar) {
    const double sigma2 = spec.sigma.in(radian) * spec.sigma.in(radian);
    material.a = static_cast<float>(1.0 - sigma2 / (2.0 * (sigma2 + 0.33)));
    material.b = static_cast<float>(0.45 * sigma2 / (sigma2 + 0.09));
  }
  return material;
}

}  // namespace toftwin::sim
