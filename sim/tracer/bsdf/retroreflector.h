// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/tracer/bsdf/bsdf.h"

namespace toftwin::sim::bsdf {

/// Reflective sheeting: a lobe about the direction that the light came from, `share` of what is reflected;
/// the rest is Lambertian. With the von Mises–Fisher density h of the angle ψ between both directions,
///   f = albedo · ( share · h(ψ) / max(cos θ, cos θ')  +  (1 − share) / π ),
///   h = κ / (2π (1 − e^{−2κ})) · e^{κ (cos ψ − 1)},   κ = 1/σ²
/// which is reciprocal and never gives back more than `albedo`. σ is the lobe's standard deviation along each
/// of two axes (small angles).
struct Retroreflector {
  double kappa = 3283.0;  ///< 1/σ², σ = 1°
  double share = 1.0;
  static constexpr bool kIsDelta = false;

  static Retroreflector withLobe(double sigma_rad, double share) {
    return {1.0 / (sigma_rad * sigma_rad), share};
  }

  [[nodiscard]] double value(double albedo, Vec3d from, Vec3d to) const {
    if (from.z <= 0.0 || to.z <= 0.0) return 0.0;
    return albedo * (share * lobe(from, to) / std::max(from.z, to.z) + (1.0 - share) / std::numbers::pi);
  }
  [[nodiscard]] double density(double, Vec3d from, Vec3d to) const {
    if (to.z <= 0.0) return 0.0;
    return share * lobe(from, to) + (1.0 - share) * cosineDensity(to);
  }
  [[nodiscard]] Scattered sample(double albedo, Vec3d from, Draw draw) const {
    const Vec3d to = draw.choice < share ? nearTo(from, draw) : cosineDirection(draw.u, draw.v);
    if (to.z <= 0.0) return {};  // behind the sheet: lost
    const double p = density(albedo, from, to);
    return {to, value(albedo, from, to) * to.z / p, p, 0.0};
  }

 private:
  [[nodiscard]] double lobe(Vec3d from, Vec3d to) const {
    const Vec3d apart = from - to;  // 1 − cos ψ = |from − to|²/2, without cancellation
    return kappa / (2.0 * std::numbers::pi * -std::expm1(-2.0 * kappa)) *
           std::exp(-0.5 * kappa * dot(apart, apart));
  }
  [[nodiscard]] Vec3d nearTo(Vec3d axis, Draw draw) const {
    // 1 − cos ψ from its inverse distribution
    const double w = -std::log1p(draw.u * std::expm1(-2.0 * kappa)) / kappa;
    const double sine = std::sqrt(std::max(0.0, w * (2.0 - w))), phi = 2.0 * std::numbers::pi * draw.v;
    const double sign = std::copysign(1.0, axis.z), a = -1.0 / (sign + axis.z), b = axis.x * axis.y * a;
    const Vec3d x{1.0 + sign * axis.x * axis.x * a, sign * b, -sign * axis.x},
        y{b, sign + axis.y * axis.y * a, -axis.y};
    return x * (sine * std::cos(phi)) + y * (sine * std::sin(phi)) + axis * (1.0 - w);
  }
};

}  // namespace toftwin::sim::bsdf
