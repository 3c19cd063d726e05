// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/client.h>
#include <toftwin/result.h>

#include "calib/compare/feed.h"
#include "calib/compare/json.h"
#include "calib/compare/poses.h"
#include "calib/compare/progress.h"
#include "calib/compare/same_frames.h"
#include "calib/compare/stack.h"

namespace toftwin::compare {

/// What was captured at one pose.
struct CapturedPose {
  std::string name;
  std::optional<Transform<World, Camera>> asked;  ///< of the cameras, whether or not they say it
  Stack a, b;
};

/// One pair of frames: the i-th of both cameras at a pose.
struct FramePair {
  std::size_t pose = 0;
  double since_power_on_a_s = 0.0, since_power_on_b_s = 0.0;  ///< NaN where unknown
  double median_difference_mm =
      0.0;  ///< of B − A over the pixels valid in both and not gross; NaN for different camera models
};

struct Capture {
  SourceDetails a, b;
  std::vector<CapturedPose> poses;
  std::vector<FramePair> pairs;
  std::vector<Json> log;  ///< one entry per frame: source, sequence, times, ids, effects
  std::vector<std::string> warnings;  ///< what a reader must know
  SameFrames same{};  ///< whether they are two cameras
};

struct CaptureOptions {
  std::vector<PoseSpec> poses{};              ///< empty: one capture where the cameras are
  int frames = 30;                            ///< per pose and camera
  std::chrono::milliseconds timeout{60'000};  ///< for one frame
  int most_skipped = 10'000;                  ///< frames of other poses before it is given up
  std::function<bool()> interrupted{};        ///< asked between frames
  Carrier* carrier = nullptr;                 ///< moves the cameras, if they cannot move themselves
  /// A or B, which at each pose is set to the moment that the other one's first frame there tells; null:
  /// neither.
  Feed* twin = nullptr;
};

/// Captures both cameras at the same poses. A pose is set on each camera that can; frames that say
/// another pose are skipped (they were made before, or a recording has not reached it yet). Errors
/// say which camera could not follow and why. At the end each camera is put back to where it stood, and the
/// twin to what it was set to.
Result<Capture> capture(Feed& a, Feed& b, const CaptureOptions& options, Progress& progress);
void planCapture(Progress& progress, const CaptureOptions& options);

/// By how much the clock of the daemon that a frame has come from is ahead of ours, s: between these, as the frame was
/// made after it was asked for, and is here now.
struct ClockOffset {
  double low_s = 0.0, high_s = 0.0;
  /// More than a second off.
  [[nodiscard]] bool isNotable() const { return low_s > 1.0 || high_s < -1.0; }
  [[nodiscard]] bool mayBe(const ClockOffset& other) const { return low_s <= other.high_s && other.low_s <= high_s; }
};
/// Nothing of frames that were recorded, or do not say when they were received.
std::optional<ClockOffset> clockOffset(const Frame& frame, std::chrono::system_clock::time_point asked);

/// What a reader must know of the clock of the daemon that a frame has come from: that by it the frame is from before
/// it was asked for, or from the future, by more than a second. Nothing of frames that were recorded.
std::string clockWarning(const Frame& frame, std::chrono::system_clock::time_point asked);

/// What is not told as the camera does not give it: a sentence for each plane that a comparison would read.
std::vector<std::string> missingPlanes(const Frame& frame);

/// The next frame of that pose; frames that say another one are skipped. Stopped soon after the user
/// wants to end.
Result<Frame> nextFrameAt(Feed& feed, const std::optional<Transform<World, Camera>>& pose,
                          const CaptureOptions& options);

}  // namespace toftwin::compare
