// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/geometry.h>
#include <toftwin/result.h>

#include "calib/plan/place.h"
#include "calib/plan/plan.h"

namespace toftwin::plan {

/// One capture of a plan: what the cameras shall stand at and be set to.
struct PlannedCapture {
  std::size_t number = 0;                    ///< place in the plan's order
  std::size_t block = 0;                     ///< of Plan::blocks
  std::size_t condition = 0;                 ///< within the block, in the order written
  int repeat = 0;                            ///< how often the condition was captured before
  std::string name;                          ///< "distance: 1.2 m"
  std::optional<compare::PoseSpec> pose;     ///< nothing: where the cameras are
  double distance_m = 0.0, angle_deg = 0.0;  ///< of the target; NaN without a pose
  Duration exposure{};                       ///< 0: the camera's own
  Illuminance ambient{};
  int frames = 0;
  bool is_locked = false;
  std::optional<std::size_t> again;  ///< the capture whose condition this one repeats, of an earlier block
  Duration start{}, duration{};      ///< as planned, from the begin of the first capture
};

/// A plan's captures in the order in which they are taken.
struct Schedule {
  std::vector<PlannedCapture> captures;
  Duration setups{};  ///< what people need to prepare
  Duration total{};
};

/// What captures take: one frame interval for each frame of either camera.
struct Tempo {
  Duration frame_a = (1.0 / 30.0) * second, frame_b = (1.0 / 30.0) * second;
};

/// Equal for equal plans, whatever was skipped elsewhere and however fast the cameras are. Errors: a block
/// of repeats finds too few conditions.
Result<Schedule> scheduleOf(const Plan& plan, const Tempo& tempo = {});

/// How one thing goes with another: Pearson's correlation; 0 where one of them does not change.
double correlation(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace toftwin::plan
