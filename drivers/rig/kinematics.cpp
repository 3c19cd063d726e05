// SPDX-License-Identifier: Apache-2.0
#include "drivers/rig/kinematics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace toftwin::rig {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
constexpr int kRounds = 60;
constexpr int kRandomStarts = 24;
constexpr std::uint64_t kSeed = 20'267;

using Positions = std::vector<double>;
using Residual = std::array<double, 6>;

Vec3d vec(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

Transform<World, World> motionOf(const AxisSpec& axis, double position) {
  const Vec3d direction = normalised(vec(axis.direction));
  if (axis.kind == AxisKind::Linear) {
    return {{1.0, 0.0, 0.0, 0.0}, direction * (position * 1e-3)};
  }
  auto turn = rotation<World, World>(direction, position * kRadians);
  const Vec3d point = vec(axis.point_m);
  turn.translation_m = point - turn.rotate(point);
  return turn;
}

Transform<World, Camera> mountOf(const RigFile& rig) {
  const auto& e = rig.mount_euler_deg;
  const auto x = rotation<World, World>({1, 0, 0}, e[0] * kRadians);
  const auto y = rotation<World, World>({0, 1, 0}, e[1] * kRadians);
  const auto z = rotation<World, World>({0, 0, 1}, e[2] * kRadians);
  return {(z * y * x).rotation_wxyz, vec(rig.mount_position_m)};
}

/// In millimetres: of the pinhole, and of the rotation at an arm of 1 m.
Residual missBy(const RigFile& rig, const Positions& positions,
                const Transform<World, Camera>& wanted) {
  const auto is = poseAt(rig, positions);
  const Vec3d shift = is.translation_m - wanted.translation_m;
  auto turn = (wanted.inverse() * is).rotation_wxyz;
  if (turn[0] < 0.0) {
    for (double& q : turn) q = -q;
  }
  const double sine = std::hypot(turn[1], turn[2], turn[3]);
  const double angle_per_sine = sine < 1e-9 ? 2.0 : 2.0 * std::atan2(sine, turn[0]) / sine;
  return {1e3 * shift.x,
          1e3 * shift.y,
          1e3 * shift.z,
          1e3 * angle_per_sine * turn[1],
          1e3 * angle_per_sine * turn[2],
          1e3 * angle_per_sine * turn[3]};
}

double squaresOf(const Residual& r) {
  double sum = 0.0;
  for (const double e : r) sum += e * e;
  return sum;
}

/// Solves A x = b, A symmetric and positive definite, by Gauss elimination.
Positions solve(std::vector<Positions> a, Positions b) {
  const std::size_t n = b.size();
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t i = k + 1; i < n; ++i) {
      const double factor = a[i][k] / a[k][k];
      for (std::size_t j = k; j < n; ++j) a[i][j] -= factor * a[k][j];
      b[i] -= factor * b[k];
    }
  }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t j = k + 1; j < n; ++j) b[k] -= a[k][j] * b[j];
    b[k] /= a[k][k];
  }
  return b;
}

Positions withinLimits(const RigFile& rig, Positions positions) {
  for (std::size_t i = 0; i < positions.size(); ++i) {
    positions[i] = std::clamp(positions[i], rig.axes[i].min, rig.axes[i].max);
  }
  return positions;
}

/// Levenberg-Marquardt from `q`, projected into the limits.
Positions improve(const RigFile& rig, Positions q, const Transform<World, Camera>& wanted) {
  const std::size_t n = q.size();
  double damping = 1e-3;
  Residual r = missBy(rig, q, wanted);
  for (int round = 0; round < kRounds && squaresOf(r) > 1e-16; ++round) {
    std::vector<Residual> slopes(n);
    for (std::size_t i = 0; i < n; ++i) {
      constexpr double kStep = 1e-4;  // mm or degrees: central differences, error below 1e-9
      Positions up = q, down = q;
      up[i] += kStep, down[i] -= kStep;
      const Residual above = missBy(rig, up, wanted), below = missBy(rig, down, wanted);
      for (std::size_t k = 0; k < 6; ++k) slopes[i][k] = (above[k] - below[k]) / (2.0 * kStep);
    }
    std::vector<Positions> normal(n, Positions(n));
    Positions right(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        for (std::size_t k = 0; k < 6; ++k) normal[i][j] += slopes[i][k] * slopes[j][k];
      }
      for (std::size_t k = 0; k < 6; ++k) right[i] -= slopes[i][k] * r[k];
      normal[i][i] = normal[i][i] * (1.0 + damping) + 1e-12;
    }
    const Positions step = solve(std::move(normal), std::move(right));
    Positions next = q;
    for (std::size_t i = 0; i < n; ++i) next[i] += step[i];
    next = withinLimits(rig, std::move(next));
    const Residual r_next = missBy(rig, next, wanted);
    const bool is_better = squaresOf(r_next) < squaresOf(r);
    damping = std::clamp(damping * (is_better ? 0.1 : 10.0), 1e-12, 1e9);
    if (is_better) q = std::move(next), r = r_next;
  }
  return q;
}

/// How far the axes travel, each as a share of its limits' distance.
double travel(const RigFile& rig, const Positions& from, const Positions& to) {
  double sum = 0.0;
  for (std::size_t i = 0; i < to.size(); ++i) {
    sum += std::abs(to[i] - from[i]) / (rig.axes[i].max - rig.axes[i].min);
  }
  return sum;
}

}  // namespace

Transform<World, Camera> poseAt(const RigFile& rig, const Positions& positions) {
  Transform<World, World> moved;
  for (std::size_t i = 0; i < rig.axes.size(); ++i)
    moved = moved * motionOf(rig.axes[i], positions[i]);
  return moved * mountOf(rig);
}

Result<Positions> positionsFor(const RigFile& rig, const Transform<World, Camera>& pose,
                               const Positions& near) {
  std::mt19937_64 random{kSeed};
  std::vector<Positions> starts{withinLimits(rig, near), {}};
  for (const AxisSpec& axis : rig.axes) starts[1].push_back(0.5 * (axis.min + axis.max));
  for (int i = 0; i < kRandomStarts; ++i) {
    Positions start;
    for (const AxisSpec& axis : rig.axes) {
      const double share = static_cast<double>(random() >> 11) * 0x1p-53;
      start.push_back(axis.min + share * (axis.max - axis.min));
    }
    starts.push_back(std::move(start));
  }
  const double tolerance_mm = rig.pose_tolerance.in(millimetre);
  Positions best, nearest;
  double best_travel = std::numeric_limits<double>::infinity(), least = best_travel;
  for (const Positions& start : starts) {
    Positions found = improve(rig, start, pose);
    const Residual r = missBy(rig, found, pose);
    const double miss = std::max(std::hypot(r[0], r[1], r[2]), std::hypot(r[3], r[4], r[5]));
    if (miss <= tolerance_mm && travel(rig, near, found) < best_travel) {
      best_travel = travel(rig, near, found);
      best = found;
    }
    if (miss < least) least = miss, nearest = std::move(found);
  }
  if (!best.empty()) return best;
  const Residual r = missBy(rig, nearest, pose);
  std::string where;
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    where += fmt::format("{}{} = {:.3f}", i == 0 ? "" : ", ", rig.axes[i].name, nearest[i]);
  }
  return Error{
      Error::Code::NotFound,
      fmt::format("the rig cannot take the camera there within its soft limits; nearest is "
                  "{:.2f} mm and {:.3f} deg off, at {}",
                  std::hypot(r[0], r[1], r[2]), std::hypot(r[3], r[4], r[5]) * 1e-3 / kRadians,
                  where)};
}

}  // namespace toftwin::rig
