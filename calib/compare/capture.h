// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/client.h>
#include <toftwin/result.h>

#include "calib/compare/json.h"
#include "calib/compare/poses.h"
#include "calib/compare/progress.h"
#include "calib/compare/same_frames.h"
#include "calib/compare/stack.h"

namespace toftwin::compare {

/// One of the two cameras, as the capture sees it: what it is, its frames, and its pose.
class Feed {
 public:
  virtual ~Feed() = default;
  [[nodiscard]] virtual const SourceDetails& details() const = 0;
  /// From a camera that cannot lockstep, the newest frame.
  virtual Result<Frame> next(std::chrono::milliseconds timeout) = 0;
  virtual Result<> setPose(const Transform<World, Camera>& world_from_camera) = 0;
  virtual Result<> setParameter(std::string_view name, double value);
  /// Forgets frames that are under way: the next one is taken from now on.
  virtual Result<> beginAnew() { return {}; }
  /// What a reader must know of it, or nothing: that a recording is damaged.
  [[nodiscard]] virtual std::string warning() const { return {}; }
  /// Its frames' times say when they were recorded, not when they are read.
  [[nodiscard]] virtual bool isRecorded() const { return false; }
  /// By our clock. Frames of a daemon are made after that.
  [[nodiscard]] std::chrono::system_clock::time_point opened() const { return opened_; }

 protected:
  /// `opened`: another time than now only in tests.
  explicit Feed(std::chrono::system_clock::time_point opened = std::chrono::system_clock::now()) : opened_(opened) {}

 private:
  std::chrono::system_clock::time_point opened_;
};

/// What takes the cameras from pose to pose, where they cannot be put there by a command.
class Carrier {
 public:
  virtual ~Carrier() = default;
  /// Where they really stand, when they have come to rest; an Error if it is not where they should.
  virtual Result<Transform<World, Camera>> go(const PoseSpec& pose) = 0;
  /// Asked when the frames of a pose are there: an Error if they did not stand still meanwhile.
  virtual Result<> stillThere() = 0;
  /// What the log says of the pose, such as axes and temperatures.
  [[nodiscard]] virtual Json log() const = 0;
  /// Where it measures any: "room" among them.
  [[nodiscard]] virtual std::vector<NamedTemperature> temperatures() const { return {}; }
};

/// A source of a daemon: in LOCKSTEP where it can, so that no frame is made or lost without us,
/// else LATEST: the newest frame whenever we are ready for one. The client must outlive it. `more`:
/// planes besides those that a comparison reads, where the source has them.
Result<std::unique_ptr<Feed>> openFeed(Client& client, const std::string& source,
                                       const std::vector<PlaneKind>& more = {});

/// A recording: "file.mcap", or "file.mcap#source" where it holds several sources. It cannot be
/// moved; its frames are taken at the poses they say.
Result<std::unique_ptr<Feed>> openRecording(const std::string& file_and_source);

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
