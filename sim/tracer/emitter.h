// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

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
  double cos_limit = 0.0;  ///< dark where cos γ is below it
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
    const Basis basis = basisAround(axis);
    across = basis.x * spec.radius.in(metre);
    along = basis.y * spec.radius.in(metre);
  }

  /// A place on the disc, uniform by area, from two random numbers. Seen from one direction each
  /// place of the disc has the same share of I(γ), so the estimate needs no further weight.
  [[nodiscard]] Vec3d place(double u, double v) const {
    const double r = std::sqrt(u), phi = 2.0 * std::numbers::pi * v;
    return position + across * (r * std::cos(phi)) + along * (r * std::sin(phi));
  }
};

}  // namespace toftwin::sim
