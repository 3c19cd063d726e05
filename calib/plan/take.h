// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "calib/compare/capture.h"
#include "calib/plan/captures.h"
#include "calib/plan/plan.h"
#include "calib/plan/pose_finder.h"

namespace toftwin::plan {

/// The person who does what no command can.
class Person {
 public:
  virtual ~Person() = default;
  /// Shows what is to be done and comes back when it is; an Error if it will not be.
  virtual Result<> doThis(const std::string& what) = 0;
};

/// How captures are taken.
struct TakeOptions {
  std::chrono::milliseconds timeout{60'000};  ///< for one frame
  std::function<bool()> interrupted{};        ///< asked between frames and while waiting
  compare::Carrier* carrier = nullptr;        ///< takes the cameras to their poses
  Person* person = nullptr;                   ///< never null
  /// The clock, and how it is waited for; others only in tests.
  std::function<std::chrono::steady_clock::time_point()> now = std::chrono::steady_clock::now;
  std::function<void(std::chrono::duration<double>)> sleep = [](std::chrono::duration<double> time) {
    std::this_thread::sleep_for(time);
  };
  /// How long A was on when the plan began, where it does not say so itself. A simulated A is set to it.
  std::optional<Duration> powered_on_for{};
};

/// What is known of one camera's part of a capture, besides its frames.
struct TakenBy {
  std::string source, model;
  std::uint64_t frames = 0;
  std::optional<Duration> since_power_on{};  ///< of the first frame
  std::vector<NamedTemperature> temperatures{};
  std::optional<Illuminance> ambient{};
  std::optional<Duration> exposure{};  ///< the longest of the first frame's
  std::optional<compare::ClockOffset> clock{};  ///< of its daemon, by the first frame
  std::string clock_warning{};                  ///< what a reader must know of that, or nothing
};

/// What was captured, and how.
struct Taken {
  std::optional<Transform<World, Camera>> pose{};
  /// "camera", "rig", "person", "board", "planes", "rig with the board's help"; "" where they were left
  std::string pose_by{};
  std::optional<SeenPose> seen{};  ///< what the pose was told from, where a camera saw it
  std::optional<SeenPose> seen_by_b{};  ///< where B saw itself, where it did
  std::int64_t began_ns = 0;
  TakenBy a{}, b{};
  compare::Json rig{};
  std::vector<std::string> notes{};
};

/// Takes the captures of a plan, one after the other; remembers what it set and what a person did.
class Taker {
 public:
  Taker(const Plan& plan, TakeOptions options)
      : plan_(plan), options_(std::move(options)), finder_a_(plan), finder_b_(plan) {}

  /// Frames go to the sinks as they come. A first: then B, where it can, is set to what A's first frame says
  /// of the moment: time since power-on, ambient light, room temperature, exposure. Errors say what could not
  /// be done and what to do; nothing of such a capture counts.
  using Sink = std::function<Result<>(const Frame&)>;
  Result<Taken> take(const PlannedCapture& planned, compare::Feed& a, compare::Feed& b, const Sink& to_a,
                     const Sink& to_b);
  /// Before a block whose poses are taken from the board: whether a B that takes poses, which is put where A
  /// sees the board and so need not look itself, sees it, where the plan has it. Nothing of other blocks and
  /// cameras.
  Result<> checkBoardOf(const PlannedCapture& planned, compare::Feed& b);
  /// Puts poses and settings of a camera back to what they were before the first capture with it.
  std::vector<std::string> putBack(compare::Feed& feed);

 private:
  Result<> waitForTurn(const PlannedCapture& planned, compare::Feed& a);
  Result<> prepare(const PlannedCapture& planned);
  Result<> stand(const PlannedCapture& planned, compare::Feed& a, compare::Feed& b, Taken& taken);
  Result<> lookAround(const PlannedCapture& planned, compare::Feed& a, compare::Feed& b, Taken& taken);
  Result<SeenPose> seenBy(const PlannedCapture& planned, compare::Feed& feed, PoseFinder& finder,
                          const Taken& taken);
  Result<> standBy(const compare::PoseSpec& pose, compare::Feed& feed, Taken& taken);
  Result<> setUp(const PlannedCapture& planned, compare::Feed& feed, const std::string& ambient_told);
  Result<> dropFirst(const PlannedCapture& planned, compare::Feed& feed, const Taken& taken);
  Result<TakenBy> framesOf(const PlannedCapture& planned, compare::Feed& feed, const Taken& taken,
                           const Sink& sink, const std::optional<Duration>& since_power_on,
                           std::optional<Frame>* first);
  Result<> follow(const PlannedCapture& planned, const Frame& leader, compare::Feed& feed, Taken& taken);
  Result<> tell(const std::string& about, const std::string& what);
  [[nodiscard]] compare::CaptureOptions captureOptions() const;
  [[nodiscard]] std::optional<Transform<World, Camera>> saidBy(const compare::Feed& feed,
                                                               const Taken& taken) const;

  Plan plan_;
  TakeOptions options_;
  std::optional<std::size_t> block_;                          ///< of the last capture
  std::map<std::string, std::string> told_;                   ///< what a person did last, by what it is about
  std::map<std::string, std::map<std::string, double>> set_;  ///< parameters, by source
  std::set<const compare::Feed*> known_;  ///< whose first frame was seen
  PoseFinder finder_a_, finder_b_;
  std::optional<compare::ClockOffset> clock_told_a_, clock_told_b_;  ///< what was last said of their daemons' clocks
  bool is_seed_told_ = false;  ///< that both are simulated with one: said once
  std::map<const compare::Feed*, std::optional<Transform<World, Camera>>> says_;  ///< pose that its frames say, if any
  std::optional<std::chrono::steady_clock::time_point> began_, last_began_;
};

}  // namespace toftwin::plan
