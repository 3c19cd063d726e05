// SPDX-License-Identifier: Apache-2.0
// Two walls at 90° that meet in the z axis: A is y = 0, x > 0, B is x = 0, y > 0. The camera, with an
// isotropic point light in its pinhole, stands on the bisector at distance D from the edge.
#pragma once

#include "tests/tracer/tracing.h"

namespace toftwin::sim::testing {

struct Corner {
  double distance = 1.5;   ///< D, m
  double wall_length = 60.0;  ///< from the edge; the infinite wall's rest adds less than 1e-5 of the light
  double wall_height = 120.0;
  double albedo = 0.8;
  Vec3d shift{};           ///< where the edge's middle stands in the world
  std::string more;        ///< further objects

  [[nodiscard]] double side() const { return distance / std::sqrt(2.0); }  ///< a = b
  [[nodiscard]] Scene scene() const {
    const auto wall = [&](const char* euler, double x, double y) {
      return "[[object]]\nshape = 'rectangle'\nmaterial = 'm'\neuler_deg = " + std::string{euler} +
             "\nsize_m = [" + number(wall_length) + ", " + number(wall_height) + ", 0]\nposition_m = [" +
             number(x + shift.x) + ", " + number(y + shift.y) + ", " + number(shift.z) + "]\n";
    };
    // A rectangle lies in x, y: turned about x by 90° its y edge becomes the world's z.
    return sceneOf("[[material]]\nname = 'm'\nalbedo = " + number(albedo) + "\n" +
                   wall("[90, 0, 0]", wall_length / 2, 0.0) + wall("[90, 0, 90]", 0.0, wall_length / 2) + more);
  }
  static std::string number(double value) {
    std::string text = std::to_string(value);
    return text;
  }

  /// A camera of one pixel that looks from the bisector at (s, 0, 0) on wall A.
  [[nodiscard]] TraceRequest lookingAt(double s, std::vector<Frequency> frequencies) const {
    TraceRequest request = requestFor(1, 1, 1.0, std::move(frequencies));
    const Vec3d eye = Vec3d{side(), side(), 0.0} + shift;
    const Vec3d ahead = normalised(Vec3d{s - side(), -side(), 0.0});
    // Turn the optical axis (0, 0, 1) to `ahead`: half-way rotation about their normal.
    const Vec3d axis = normalised(cross(Vec3d{0, 0, 1}, ahead));
    request.world_from_camera = rotation<World, Camera>(axis, std::acos(ahead.z));
    request.world_from_camera.translation_m = eye;
    return request;
  }
  [[nodiscard]] double range(double s) const { return std::hypot(s - side(), side()); }
};

}  // namespace toftwin::sim::testing
