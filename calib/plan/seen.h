// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/image.h>
#include <toftwin/result.h>

#include "calib/compare/stack.h"
#include "calib/compare/traits/traits.h"
#include "calib/plan/camera_seen.h"
#include "calib/plan/plan.h"
#include "calib/plan/run_index.h"

namespace toftwin::plan {

/// Whether so much of the wall is a period or more farther than the camera can tell that the rest of it,
/// which noise made too near, does not stand for the camera's errors.
bool isWrapped(const CameraSeen& seen);
/// Whether the pose was fitted to A's own ranges of the plan's planes: a wall's errors along its normal are in the
/// pose then, and what is left of them says nothing of the camera.
bool isPoseFromPlanes(const CaptureRecord& record);
/// Where the pose was seen, as of a board: the condition, in all of whose captures it errs alike, by where the corners
/// fall among the pixels. None where each capture has an error of its own.
std::optional<CaptureRecord::Condition> sharedPoseOf(const CaptureRecord& record);
/// Standard error of the range to the target's wall where a pose's 95 % half widths are these: those of its place
/// along the wall's normal. Turns move the two sides of a wall against each other.
double poseError_mm(const Plan& plan, const CaptureRecord& record,
                    const std::optional<std::array<double, 6>>& half_widths);
/// What of a frame seenOf() needs.
Result<ReadFrame> readOf(const Frame& frame);
/// What such blocks give; NaN and empty columns where the plan does not say what stands there. Where
/// isPoseFromPlanes(), no errors against walls: their columns are empty; wall_wraps, which are off by
/// periods, are counted nevertheless. `frequency_hz`: of modulation, ascending; empty where it is not known.
/// `own_pose`: where the camera saw itself, if that is not the pose that its frames say.
CameraSeen seenOf(const Plan& plan, const CaptureRecord& record, const compare::Stack& stack,
                  const std::vector<ReadFrame>& frames, std::span<const double> frequency_hz,
                  const std::optional<Transform<World, Camera>>& own_pose = std::nullopt);

/// Range to the target's wall along each pixel's ray; NaN where it is not before the camera, or ends.
Image<float> wallRange_m(const Plan& plan, const BlockSpec& block, const CameraInfo& camera,
                         const Transform<World, Camera>& pose);
/// The same for the block and the pose of a capture; an empty image where either is not known.
Image<float> wallRange_m(const Plan& plan, const CaptureRecord& record, const compare::Stack& stack);

}  // namespace toftwin::plan
