// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <toftwin/geometry.h>
#include <toftwin/units.h>

namespace toftwin::sim {

/// How a thing moves: either steadily, or from one keyframe to the next. Times count from the scene's
/// start, which is device time 0.
///
///   steadily:   p(t) = p₀ + v t,   R(t) = exp(t ω) R₀   with ω a rotation vector in the world
///   keyframes:  linear in position, the shorter great arc in rotation; before the first and after the
///               last it stands still, or begins anew after `period`
struct Motion {
  struct Key {
    double time_s = 0.0;
    std::array<double, 4> rotation_wxyz{1.0, 0.0, 0.0, 0.0};
    Vec3d position_m;
    bool operator==(const Key&) const = default;
  };
  Vec3d velocity_m_per_s;
  Vec3d rotation_rad_per_s;
  std::vector<Key> keys;  ///< in order of time; empty: steadily
  double period_s = 0.0;  ///< 0: once

  bool operator==(const Motion&) const = default;
  [[nodiscard]] bool isStill() const {
    return keys.size() < 2 && velocity_m_per_s == Vec3d{} && rotation_rad_per_s == Vec3d{};
  }
};

/// Great arc from one unit quaternion to another.
inline std::array<double, 4> slerp(const std::array<double, 4>& from, std::array<double, 4> to,
                                   double share) {
  double cosine = 0.0;
  for (std::size_t i = 0; i < 4; ++i) cosine += from[i] * to[i];
  if (cosine < 0.0) {  // q and −q are the same rotation: the shorter way
    for (double& c : to) c = -c;
    cosine = -cosine;
  }
  const double angle = std::acos(std::min(1.0, cosine)), sine = std::sin(angle);
  const double a = sine > 1e-9 ? std::sin((1.0 - share) * angle) / sine : 1.0 - share;
  const double b = sine > 1e-9 ? std::sin(share * angle) / sine : share;
  std::array<double, 4> q{};
  double length2 = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    q[i] = a * from[i] + b * to[i];
    length2 += q[i] * q[i];
  }
  for (double& c : q) c /= std::sqrt(length2);
  return q;
}

/// The pose at a time of a thing that is at `start` at time 0.
template <class From>
Transform<World, From> poseAt(const Motion& motion, const Transform<World, From>& start, Duration time) {
  double t = time.in(second);
  Transform<World, From> pose = start;
  if (motion.keys.empty()) {
    const double rate = norm(motion.rotation_rad_per_s);
    if (rate > 0.0) {
      const Transform<World, World> turn = rotation<World, World>(motion.rotation_rad_per_s / rate, rate * t);
      const Transform<World, From> turned = turn * Transform<World, From>{start.rotation_wxyz, {}};
      pose.rotation_wxyz = turned.rotation_wxyz;
    }
    pose.translation_m = start.translation_m + motion.velocity_m_per_s * t;
    return pose;
  }
  if (motion.period_s > 0.0) t -= std::floor(t / motion.period_s) * motion.period_s;
  const auto after =
      std::find_if(motion.keys.begin(), motion.keys.end(), [&](const auto& key) { return key.time_s > t; });
  if (after == motion.keys.begin() || after == motion.keys.end()) {
    const Motion::Key& key = after == motion.keys.begin() ? motion.keys.front() : motion.keys.back();
    return {key.rotation_wxyz, key.position_m};
  }
  const Motion::Key &from = *(after - 1), &to = *after;
  const double share = (t - from.time_s) / (to.time_s - from.time_s);
  return {slerp(from.rotation_wxyz, to.rotation_wxyz, share),
          from.position_m + (to.position_m - from.position_m) * share};
}

}  // namespace toftwin::sim
