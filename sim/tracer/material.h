// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "sim/tracer/bsdf/any.h"
#include "sim/tracer/scene_file.h"

namespace toftwin::sim {

/// A material as the tracer's fast path uses it: matt surfaces, f = albedo/π · (A + B …) (bsdf/diffuse.h).
/// All other models are looked up by `special`, textures by `texture`: one more than their index, 0 for none.
struct Material {
  float albedo = 0.5f;
  float emission = 0.0f;
  float a = 1.0f;
  float b = 0.0f;
  std::uint16_t special = 0;
  std::uint16_t texture = 0;
};

inline bool isMatt(Reflection model) {
  return model == Reflection::Lambertian || model == Reflection::OrenNayar;
}

inline Material materialOf(const MaterialSpec& spec) {
  Material material{.albedo = static_cast<float>(spec.albedo), .emission = static_cast<float>(spec.emission)};
  if (spec.model == Reflection::ThinGlass) material.albedo = 0.0f;  // nothing is scattered
  if (spec.model == Reflection::OrenNayar) {
    const bsdf::Diffuse rough = bsdf::Diffuse::rough(spec.sigma.in(radian));
    material.a = static_cast<float>(rough.a);
    material.b = static_cast<float>(rough.b);
  }
  return material;
}

/// The material's model, with the parameters that it uses.
inline bsdf::Any bsdfOf(const MaterialSpec& spec) {
  switch (spec.model) {
    case Reflection::RoughDielectric:
      return bsdf::RoughDielectric::of(spec.roughness, spec.index);
    case Reflection::RoughMetal:
      return bsdf::RoughMetal::ofRoughness(spec.roughness);
    case Reflection::Mirror:
      return bsdf::Mirror{};
    case Reflection::Retroreflector:
      return bsdf::Retroreflector::withLobe(spec.lobe.in(radian), spec.lobe_share);
    case Reflection::Translucent:
      return bsdf::Translucent{spec.through, spec.delay.in(second)*kSpeedOfLight_m_per_s};
    case Reflection::ThinGlass:
      return bsdf::ThinGlass{spec.index, spec.clarity, spec.thickness.in(metre)};
    case Reflection::OrenNayar:
      return bsdf::Diffuse::rough(spec.sigma.in(radian));
    case Reflection::Lambertian:
      break;
  }
  return bsdf::Diffuse{};
}

}  // namespace toftwin::sim
