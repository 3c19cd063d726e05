// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include <toftwin/clock.h>
#include <toftwin/fields.h>
#include <toftwin/result.h>

#include "calib/compare/poses.h"
#include "sim/tracer/motion.h"

namespace toftwin::cli {

/// Device times are counted in nanoseconds of 64 bits; seconds since 1970 are such times.
constexpr double kMostTime_s = 9e9;

/// A pose of a pose file as `toftwin compare` reads it, with the time at which the camera is there.
struct TimedPoseSpec : compare::PoseSpec {
  Duration time{};

  template <class Visitor>
  void visit(Visitor& v) {
    compare::PoseSpec::visit(v);
    v.quantity(
        "time", time, second, {0.0, kMostTime_s},
        "when the camera is there, since device time 0; each later than the one before. In all poses or "
        "in none: then it stands still at each for one frame");
  }
};

/// Where a camera is, when.
struct Trajectory {
  std::vector<sim::Motion::Key> poses;
  bool has_times = false;  ///< else a frame at each pose, where the camera stands still
};

/// From [[pose]] tables (.toml), or from a text table of any other name with the columns x_m, y_m, z_m, q_w, q_x, q_y, q_z
/// and, perhaps, time_s, or those of TUM's benchmark: tx, ty, tz, qx, qy, qz, qw, timestamp. Errors name file and line.
Result<Trajectory> loadTrajectory(const std::filesystem::path& file);
Result<Trajectory> loadTrajectoryToml(const std::filesystem::path& file);
Result<Trajectory> loadTrajectoryCsv(const std::filesystem::path& file);

/// When the frames begin: the first at `start`, each `interval_ns` after the one before.
struct Schedule {
  std::uint64_t frames = 1;
  DeviceTime start;
  std::int64_t interval_ns = 0;

  [[nodiscard]] DeviceTime startOf(std::uint64_t frame) const {
    return {start.ns + static_cast<std::int64_t>(frame) * interval_ns};
  }
};

/// As many frames as asked for; 0: one for each pose without a time, else as many as fit between the first
/// pose and the last. InvalidArgument: more than there are poses without a time.
Result<Schedule> scheduleOf(const Trajectory& trajectory, std::uint64_t frames, Duration frame_interval);

}  // namespace toftwin::cli
