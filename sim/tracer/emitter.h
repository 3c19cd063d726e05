// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <toftwin/geometry.h>

#include "sim/tracer/trace.h"

namespace toftwin::sim {

/// Two unit vectors that complete the unit vector `n` to a right-handed basis (Duff et al. 2017).
struct Basis {
  Vec3d x, y;
};
inline Basis basisAround(Vec3d n) {
  const double sign = std::copysign(1.0, n.z);
  const double a = -1.0 / (sign + n.z);
  const double b = n.x * n.y * a;
  return {{1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}};
}

/// An emitter placed in the scene.
struct PlacedEmitter {
  Vec3d position;
  Vec3d axis;
  Vec3d across, along;  ///< span the disc, each of the disc's radius long; zero for a point
  double peak = 0.0;    ///< I(0) in W/sr
  double exponent = 1.0;
  double cos_limit = 0.0;       ///< dark where cos γ is below it
  double area = 0.0;            ///< of the disc, m²
  double delay_m = 0.0;         ///< its light is late by that length
  std::vector<double> pattern;  ///< I(γ)/I_peak at equal steps of γ from 0 to pattern_limit; empty: the lobe
  double pattern_limit = 0.0;   ///< rad
  bool is_disc = false;
  bool is_isotropic = false;

  PlacedEmitter(const EmitterSpec& spec, const Transform<World, Camera>& scene_from_camera)
      : position((scene_from_camera * Point<Camera>{spec.position_m}).m),
        axis(scene_from_camera.rotate(normalised(spec.axis))),
        exponent(spec.lobe_exponent),
        cos_limit(std::max(0.0, std::cos(spec.half_angle.in(radian)))),
        is_disc(spec.radius.in(metre) > 0.0),
        is_isotropic(spec.isotropic) {
    const double pi = std::numbers::pi;
    peak = is_isotropic ? spec.power_w / (4.0 * pi) : spec.power_w * (exponent + 1.0) / (2.0 * pi);
    area = pi * spec.radius.in(metre)*spec.radius.in(metre);
    delay_m = spec.delay.in(second)*kSpeedOfLight_m_per_s;
    if (!spec.pattern.empty()) tabulate(spec);
    const Basis basis = basisAround(axis);
    across = basis.x * spec.radius.in(metre);
    along = basis.y * spec.radius.in(metre);
  }

  /// I at cos γ, W/sr.
  [[nodiscard]] double intensity(double cosine) const {
    if (is_isotropic) return peak;
    if (!(cosine >= std::max(cos_limit, 1e-300))) return 0.0;
    return peak * (pattern.empty() ? std::pow(cosine, exponent) : patternAt(cosine));
  }
  /// The table at cos γ, linear in γ; 0 beyond its end.
  [[nodiscard]] double patternAt(double cosine) const {
    const double step =
        std::acos(std::clamp(cosine, -1.0, 1.0)) / pattern_limit * static_cast<double>(pattern.size() - 1);
    const auto i = static_cast<std::size_t>(step);
    if (i + 1 >= pattern.size()) return step > static_cast<double>(pattern.size() - 1) ? 0.0 : pattern.back();
    const double share = step - static_cast<double>(i);
    return pattern[i] + share * (pattern[i + 1] - pattern[i]);
  }

  /// A place on the disc, uniform by area, from two random numbers. Seen from one direction each
  /// place of the disc has the same share of I(γ), so the estimate needs no further weight.
  [[nodiscard]] Vec3d place(double u, double v) const {
    const double r = std::sqrt(u), phi = 2.0 * std::numbers::pi * v;
    return position + across * (r * std::cos(phi)) + along * (r * std::sin(phi));
  }

 private:
  /// From the spec's table to one in equal steps, with power Φ = 2π ∫ I sin γ dγ.
  void tabulate(const EmitterSpec& spec) {
    constexpr std::size_t kSteps = 1024;
    exponent = 0.0;
    pattern_limit = std::min(spec.pattern_deg.back() * degree.in_si, std::numbers::pi / 2.0);
    double integral = 0.0;
    std::size_t row = 0;
    for (std::size_t i = 0; i <= kSteps; ++i) {
      const double angle = pattern_limit * static_cast<double>(i) / kSteps, at_deg = angle / degree.in_si;
      while (row + 2 < spec.pattern_deg.size() && spec.pattern_deg[row + 1] < at_deg) ++row;
      const double from = spec.pattern_deg[row], to = spec.pattern_deg[row + 1];
      const double share = std::clamp((at_deg - from) / (to - from), 0.0, 1.0);
      pattern.push_back(spec.pattern[row] + share * (spec.pattern[row + 1] - spec.pattern[row]));
      if (i == 0) continue;
      const double before = pattern_limit * static_cast<double>(i - 1) / kSteps;
      integral += std::numbers::pi * (pattern[i - 1] * std::sin(before) + pattern[i] * std::sin(angle)) *
                  (angle - before);
    }
    peak = spec.power_w / integral;
  }
};

}  // namespace toftwin::sim
