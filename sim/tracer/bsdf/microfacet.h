// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "sim/tracer/bsdf/bsdf.h"

namespace toftwin::sim::bsdf {

/// The distribution of Trowbridge & Reitz ("GGX") with Smith's height-correlated masking, α = roughness²
/// (Walter et al. 2007; Heitz 2014). Normals are drawn as they are visible (Heitz 2018).
struct Facets {
  double alpha = 0.25;

  /// D(m) cos-normalised: ∫ D cos θ dm = 1.
  [[nodiscard]] double distribution(double cosine) const {
    if (cosine <= 0.0) return 0.0;
    const double a2 = alpha * alpha, t = cosine * cosine * (a2 - 1.0) + 1.0;
    return a2 / (std::numbers::pi * t * t);
  }
  /// Smith's Λ of a direction.
  [[nodiscard]] double lambda(double cosine) const {
    const double c2 = cosine * cosine;
    return 0.5 * (std::sqrt(1.0 + alpha * alpha * (1.0 - c2) / c2) - 1.0);
  }
  /// Share of the facets that are seen from one direction, and from both.
  [[nodiscard]] double seen(double cosine) const { return 1.0 / (1.0 + lambda(cosine)); }
  [[nodiscard]] double seen(double cosine, double other) const {
    return 1.0 / (1.0 + lambda(cosine) + lambda(other));
  }
  /// Density of the reflected direction when the normal is drawn as visible: D G₁ / (4 cos θ).
  [[nodiscard]] double density(Vec3d from, Vec3d to) const;
  [[nodiscard]] Vec3d visibleNormal(Vec3d from, double u, double v) const;
  /// D G₂ / (4 cos θ cos θ'), the reflection of facets that reflect everything, times Fresnel to be done.
  [[nodiscard]] double value(Vec3d from, Vec3d to) const;
};

/// What a lobe gives back to a viewer who stands in uniform light, E(cos θ), and its mean over all cosines,
/// 2 ∫ E cos d(cos). Linear between tabulated cosines; the mean is exactly that of the table, so that what
/// is built on 1 − E conserves energy but for the interpolation.
class Reflectance {
 public:
  static constexpr std::size_t kEntries = 65;
  template <class Function>
  static Reflectance tabulate(const Function& of_cosine) {
    Reflectance table;
    for (std::size_t i = 0; i < kEntries; ++i) table.values_[i] = of_cosine(cosineOf(i));
    for (std::size_t i = 0; i + 1 < kEntries; ++i) {
      const double x0 = cosineOf(i), x1 = cosineOf(i + 1), y0 = table.values_[i], y1 = table.values_[i + 1];
      table.mean_ += (x1 - x0) / 3.0 * (y0 * (2.0 * x0 + x1) + y1 * (x0 + 2.0 * x1));  // 2 ∫ y x dx
    }
    return table;
  }
  [[nodiscard]] double at(double cosine) const {
    const double place = std::sqrt(std::clamp(cosine, 0.0, 1.0)) * (kEntries - 1);
    const auto i = std::min(static_cast<std::size_t>(place), kEntries - 2);
    const double x0 = cosineOf(i), t = (cosine - x0) / (cosineOf(i + 1) - x0);
    return values_[i] + t * (values_[i + 1] - values_[i]);
  }
  [[nodiscard]] double mean() const { return mean_; }

 private:
  /// Denser at grazing angles, where Fresnel and masking change fast.
  static double cosineOf(std::size_t i) {
    const double s = static_cast<double>(i) / (kEntries - 1);
    return s * s;
  }
  std::array<double, kEntries> values_{};
  double mean_ = 0.0;
};

/// A rough metal. `albedo` is its reflectance at normal incidence (Schlick's Fresnel). Light that meets
/// several facets before it leaves is not lost: it is returned as a second lobe (Kulla & Conty 2017),
///   f = F D G / (4 cos cos') + F_ms (1 − E(θ)) (1 − E(θ')) / (π (1 − Ē)),
///   F_ms = F̄² Ē / (1 − F̄ (1 − Ē)),   F̄ = (1 + 20 F₀) / 21
/// with E that of facets that reflect everything: at albedo 1 nothing is lost at any roughness.
struct RoughMetal {
  Facets facets;
  Reflectance single;  ///< E
  static constexpr bool kIsDelta = false;

  static RoughMetal ofRoughness(double roughness);
  [[nodiscard]] double value(double albedo, Vec3d from, Vec3d to) const;
  [[nodiscard]] double density(double albedo, Vec3d from, Vec3d to) const;
  [[nodiscard]] Scattered sample(double albedo, Vec3d from, Draw draw) const;

 private:
  [[nodiscard]] double facetShare(Vec3d from) const { return std::clamp(single.at(from.z), 0.1, 1.0); }
};

/// Varnish, plastic, glazed tiles: a rough boundary of a dielectric over a diffuse body. What the boundary
/// does not reflect enters, and `albedo` of it comes back:
///   f = F D G / (4 cos cos') + albedo (1 − E(θ)) (1 − E(θ')) / (π (1 − Ē))
/// with E that of the boundary alone, Fresnel included (Kelemen & Szirmay-Kalos 2001): at albedo 1 nothing is
/// lost, at albedo 0 it is black glass.
struct RoughDielectric {
  Facets facets;
  double index = 1.5;
  Reflectance boundary;  ///< E
  static constexpr bool kIsDelta = false;

  static RoughDielectric of(double roughness, double index);
  [[nodiscard]] double value(double albedo, Vec3d from, Vec3d to) const;
  [[nodiscard]] double density(double albedo, Vec3d from, Vec3d to) const;
  [[nodiscard]] Scattered sample(double albedo, Vec3d from, Draw draw) const;

 private:
  [[nodiscard]] double facetShare(double albedo, Vec3d from) const;
};

}  // namespace toftwin::sim::bsdf
