// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/campaign/trajectory.h"

#include <fmt/format.h>

#include <cmath>

#include "protocol/settings/settings.h"

namespace toftwin::cli {
namespace {

/// Complains about what one pose says; true if it may be used.
bool check(settings::Table& table, const TimedPoseSpec& spec) {
  double squares = 0.0;
  for (const double q : spec.rotation_wxyz) squares += q * q;
  if (squares < 1e-12) table.complain("rotation_wxyz", "is all zeros, which is no rotation");
  if (table.has("rotation_wxyz") && table.has("euler_deg"))
    table.complain("euler_deg", "and rotation_wxyz both say how it is turned; keep one");
  return squares >= 1e-12;
}

void checkTimes(settings::Table& table, bool first, const Trajectory& before, double time_s) {
  if (!first && table.has("time_s") != before.has_times) {
    table.complain("", before.has_times ? "this pose has no time_s, but those before it have"
                                        : "this pose has a time_s, but those before it have none");
  } else if (!first && before.has_times && !(time_s > before.poses.back().time_s)) {
    table.complain("time_s",
                   fmt::format("= {} is not later than that of the pose before, {}; sort the poses by time",
                               time_s, before.poses.back().time_s));
  }
}

}  // namespace

Result<Trajectory> loadTrajectoryToml(const std::filesystem::path& file) {
  auto root = settings::Table::load(file);
  if (!root) return root.error();
  Trajectory trajectory;
  bool first = true;
  for (settings::Table& table : root->tables("pose")) {
    TimedPoseSpec spec;
    table.read(spec);
    const double time_s = spec.time.in(second);
    if (first) trajectory.has_times = table.has("time_s");
    checkTimes(table, first || trajectory.poses.empty(), trajectory, time_s);
    first = false;
    if (!check(table, spec)) continue;
    const Transform<World, Camera> pose = spec.world_from_camera();
    trajectory.poses.push_back({time_s, pose.rotation_wxyz, pose.translation_m});
  }
  if (first) root->complain("", "has no [[pose]]; write one table for each pose");
  if (auto checked = root->check(); !checked) return checked.error();
  return trajectory;
}

Result<Trajectory> loadTrajectory(const std::filesystem::path& file) {
  if (file.extension() == ".toml") return loadTrajectoryToml(file);
  return loadTrajectoryCsv(file);
}

Result<Schedule> scheduleOf(const Trajectory& trajectory, std::uint64_t frames, Duration frame_interval) {
  Schedule schedule{
      .frames = frames, .start = {}, .interval_ns = std::llround(frame_interval.in(nanosecond))};
  if (trajectory.poses.empty()) {
    schedule.frames = std::max<std::uint64_t>(frames, 1);
    return schedule;
  }
  if (!trajectory.has_times) {
    if (frames > trajectory.poses.size()) {
      return Error{
          Error::Code::InvalidArgument,
          fmt::format("--frames {}: the trajectory has {} poses without time_s, and each gives one frame",
                      frames, trajectory.poses.size())};
    }
    if (frames == 0) schedule.frames = trajectory.poses.size();
    return schedule;
  }
  const double first_s = trajectory.poses.front().time_s, last_s = trajectory.poses.back().time_s;
  schedule.start.ns = std::llround(first_s * 1e9);
  const std::int64_t span_ns = std::llround(last_s * 1e9) - schedule.start.ns;
  if (frames == 0) schedule.frames = static_cast<std::uint64_t>(span_ns / schedule.interval_ns) + 1;
  return schedule;
}

}  // namespace toftwin::cli
