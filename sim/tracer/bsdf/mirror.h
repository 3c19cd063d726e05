// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/tracer/bsdf/bsdf.h"

namespace toftwin::sim::bsdf {

/// A smooth mirror: all light that it reflects, `albedo` of what arrives, leaves in one direction.
struct Mirror {
  static constexpr bool kIsDelta = true;

  [[nodiscard]] double value(double, Vec3d, Vec3d) const { return 0.0; }
  [[nodiscard]] double density(double, Vec3d, Vec3d) const { return 0.0; }
  [[nodiscard]] Scattered sample(double albedo, Vec3d from, Draw) const {
    return {{-from.x, -from.y, from.z}, albedo, kDelta, 0.0};
  }
};

/// A thin parallel plate of a clear dielectric: a window pane. With F the reflectance of one face [Fresnel]
/// and τ what one crossing lets through, all reflections to and fro within it (incoherent: they do not
/// interfere) sum up to
///   R = F + (1−F)² τ² F / (1 − F² τ²),   T = (1−F)² τ / (1 − F² τ²)
/// Light that goes through goes straight on, later by the optical length t (n cos θ' − cos θ) of a plate of
/// thickness t. Its shift to the side is left out, and reflected light counts as reflected at the near face.
struct ThinGlass {
  double index = 1.5;
  double clarity = 1.0;      ///< τ of a crossing along the normal
  double thickness_m = 0.0;  ///< t
  static constexpr bool kIsDelta = true;

  struct Shares {
    double reflected, transmitted;
  };
  /// For light at this cosine to the normal; any sign.
  [[nodiscard]] Shares shares(double cosine) const {
    const double c = std::abs(cosine), f = dielectricFresnel(c, index);
    const double tau = clarity == 1.0 ? 1.0 : std::pow(clarity, 1.0 / innerCosine(c));
    const double through = (1.0 - f) * (1.0 - f) * tau / std::max(1e-12, 1.0 - f * f * tau * tau);
    return {f + through * tau * f, through};
  }
  [[nodiscard]] double extraLength(double cosine) const {
    const double c = std::abs(cosine);
    return thickness_m * (index * innerCosine(c) - c);
  }
  [[nodiscard]] double value(double, Vec3d, Vec3d) const { return 0.0; }
  [[nodiscard]] double density(double, Vec3d, Vec3d) const { return 0.0; }
  [[nodiscard]] Scattered sample(double, Vec3d from, Draw draw) const {
    const Shares share = shares(from.z);
    const double all = share.reflected + share.transmitted;
    if (draw.choice * all < share.reflected) return {{-from.x, -from.y, from.z}, all, kDelta, 0.0};
    return {-from, all, kDelta, extraLength(from.z)};
  }

 private:
  [[nodiscard]] double innerCosine(double cosine) const {
    return std::sqrt(std::max(1e-12, 1.0 - (1.0 - cosine * cosine) / (index * index)));
  }
};

}  // namespace toftwin::sim::bsdf
