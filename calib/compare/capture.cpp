// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/capture.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include <toftwin/names.h>
#include <toftwin/nan.h>

#include "calib/compare/characteristics.h"
#include "calib/compare/follow.h"
#include "calib/compare/statistics.h"

namespace toftwin::compare {
namespace {

Error named(const Feed& feed, const Error& error, const std::string& doing) {
  return {error.code, fmt::format("{}: {}: {}", feed.details().entry.name, doing, error.message)};
}

/// A recording that ends before the pose: what is missing of a damaged one may be why.
Error endedBefore(const Feed& feed, const Error& end, int skipped) {
  const std::string damage = feed.warning();
  const std::string why = damage.empty() ? "it must have been recorded with the same pose file"
                                         : "what is missing of it may have been";
  Error error = named(
      feed, end, fmt::format("none of its last {} frames was taken at the pose asked for; {}", skipped, why));
  if (!damage.empty()) error.message += ". " + damage;
  return error;
}

Json logEntry(const Frame& frame, const std::string& pose, const char* role) {
  Json ids = Json::object();
  ids.set("calibration", frame.provenance.calibration_id).set("scene", frame.provenance.scene_id);
  ids.set("model", frame.provenance.model_id).set("seed", frame.provenance.seed);
  Json entry = Json::object();
  entry.set("pose", pose)
      .set("role", role)
      .set("source", frame.source)
      .set("sequence", frame.sequence);
  entry.set("kind", std::string{nameOf(frame.provenance.kind)})
      .set("received_ns", frame.moment.received.ns);
  entry.set("device_start_ns", frame.moment.exposures.empty()
                                   ? Json{}
                                   : Json{frame.moment.exposures.front().start.ns});
  entry.set("since_power_on_s",
            frame.moment.since_power_on ? frame.moment.since_power_on->in(second) : kNaN);
  const auto exposure = longestExposure(frame);
  entry.set("exposure_us", exposure ? exposure->in(microsecond) : kNaN)
      .set("ambient_klx", frame.moment.ambient ? frame.moment.ambient->in(kilolux) : kNaN);
  entry.set("dropped_before", frame.dropped_before)
      .set("dropped_by_device", frame.dropped_by_device);
  if (!frame.dropped_because.empty()) entry.set("dropped_because", frame.dropped_because);
  entry.set("ids", std::move(ids)).set("effects", Json::arrayOf(frame.provenance.effects));
  Json temperatures = Json::object();
  for (const auto& t : frame.moment.temperatures) temperatures.set(t.where, t.value.in(celsius));
  return std::move(entry.set("temperatures_c", std::move(temperatures)));
}

/// The next frame, or Stopped soon after the user wants to end.
Result<Frame> nextFrame(Feed& feed, const CaptureOptions& options) {
  constexpr std::chrono::milliseconds kPatience{200};
  const auto end = std::chrono::steady_clock::now() + options.timeout;
  while (true) {
    if (options.interrupted && options.interrupted())
      return Error{Error::Code::Stopped, "interrupted"};
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    auto frame = feed.next(std::clamp(left, std::chrono::milliseconds{0}, kPatience));
    if (frame || frame.error().code != Error::Code::Timeout) return frame;
    if (left > kPatience) continue;
    return Error{Error::Code::Timeout,
                 fmt::format("none came within {:.6g} s. Another client may hold the camera in "
                             "lockstep until it asks for the next frame",
                             std::chrono::duration<double>(options.timeout).count())};
  }
}

std::string poseInWords(const Transform<World, Camera>& pose) {
  const auto& t = pose.translation_m;
  const Vec3d axis = pose.rotate({0.0, 0.0, 1.0});
  return fmt::format("at x {:.4g}, y {:.4g}, z {:.4g} m and looking along {:.3g}, {:.3g}, {:.3g}", t.x, t.y, t.z,
                     axis.x, axis.y, axis.z);
}

/// How far one is from the other: their places and axes may be the same in words.
std::string awayInWords(const Transform<World, Camera>& from, const Transform<World, Camera>& to) {
  const auto turn = (from.inverse() * to).rotation_wxyz;  // cos α/2, axis sin α/2
  const double angle = 2.0 * std::atan2(std::hypot(turn[1], turn[2], turn[3]), std::abs(turn[0]));
  return fmt::format("{:.3g} mm and {:.3g}° from it", 1e3 * norm(to.translation_m - from.translation_m),
                     angle * 180.0 / std::numbers::pi);
}

/// The next frame of that pose; frames of other poses are skipped.
Result<Frame> nextAt(Feed& feed, const std::optional<Transform<World, Camera>>& pose,
                     const CaptureOptions& options) {
  Transform<World, Camera> said;
  for (int skipped = 0; skipped <= options.most_skipped; ++skipped) {
    auto frame = nextFrame(feed, options);
    if (!frame && frame.error().code == Error::Code::EndOfStream && skipped > 0)
      return endedBefore(feed, frame.error(), skipped);
    if (!frame) return named(feed, frame.error(), "waiting for a frame");
    auto& there = frame->moment.world_from_camera;
    if (pose && !there && options.carrier != nullptr) there = pose;  // the rig knows
    if (!pose || !there || samePose(*pose, *there)) return frame;
    said = *there;
  }
  return Error{Error::Code::Timeout,
               fmt::format("{}: none of {} frames was taken at the pose asked for, {}; they say {}, which is {}. A "
                           "recording must have been made with the same pose file; a camera on a rig must be moved "
                           "there.",
                           feed.details().entry.name, options.most_skipped, poseInWords(*pose), poseInWords(said),
                           awayInWords(*pose, said))};
}

/// The next frame of both, at almost the same time: a camera that makes its frames when asked, such
/// as a simulator that traces a new pose, is asked first. The other one goes on meanwhile and
/// then gives its newest frame (openFeed), not one from before.
Result<std::pair<Frame, Frame>> nextPair(Feed& a, Feed& b,
                                         const std::optional<Transform<World, Camera>>& pose,
                                         const CaptureOptions& options) {
  const bool is_b_first = b.details().can_lockstep && !a.details().can_lockstep;
  auto first = nextAt(is_b_first ? b : a, pose, options);
  if (!first) return first.error();
  auto second = nextAt(is_b_first ? a : b, pose, options);
  if (!second) return second.error();
  if (is_b_first) std::swap(*first, *second);
  return std::pair{*std::move(first), *std::move(second)};
}

/// The first pair at a pose: the camera's frame tells the twin its moment.
Result<std::pair<Frame, Frame>> firstPair(Feed& a, Feed& b, Follower& follower,
                                          const std::optional<Transform<World, Camera>>& pose,
                                          const CaptureOptions& options, Capture& result) {
  const bool is_a_twin = &follower.twin() == &a;
  // A subscription in lockstep has a frame from before at first, and that of another moment.
  if (result.poses.empty() && follower.twin().details().can_lockstep) {
    if (auto early = nextAt(follower.twin(), pose, options); !early) return early.error();
  }
  auto leading = nextAt(is_a_twin ? b : a, pose, options);
  if (!leading) return leading.error();
  for (std::string& note : follower.follow(*leading, options.carrier)) {
    if (std::ranges::find(result.warnings, note) == result.warnings.end())
      result.warnings.push_back(std::move(note));
  }
  auto following = nextAt(follower.twin(), pose, options);
  if (!following) return following.error();
  if (is_a_twin) std::swap(*leading, *following);
  return std::pair{*std::move(leading), *std::move(following)};
}

double medianDifference_mm(const Frame& a, const Frame& b) {
  if (a.camera.width != b.camera.width || a.camera.height != b.camera.height ||
      a.camera.fx != b.camera.fx || a.camera.fy != b.camera.fy || a.camera.cx != b.camera.cx ||
      a.camera.cy != b.camera.cy || a.camera.distortion != b.camera.distortion) {
    return kNaN;
  }
  const auto range_a = rangeOf(a), range_b = rangeOf(b);
  if (!range_a || !range_b) return kNaN;
  std::vector<double> difference;
  for (std::size_t i = 0; i < range_a->size(); ++i) {
    const double d =
        1e3 * (static_cast<double>((*range_b)[i]) - static_cast<double>((*range_a)[i]));
    if (!isGross(d)) difference.push_back(d);
  }
  return quantile(std::move(difference), 0.5);
}

double powerOn(const Frame& frame) {
  return frame.moment.since_power_on ? frame.moment.since_power_on->in(second) : kNaN;
}

/// N pairs of frames at one pose.
Result<> capturePose(Feed& a, Feed& b, std::optional<Follower>& follower, const CaptureOptions& options,
                     Progress& progress, CapturedPose& captured, Capture& result) {
  const auto& pose = captured.asked;
  for (Feed* feed : {&a, &b}) {
    if (!pose) continue;
    if (!feed->details().can_set_pose) {
      if (options.carrier == nullptr) continue;
      if (auto begun = feed->beginAnew(); !begun) return named(*feed, begun.error(), "subscribing");
      continue;
    }
    if (auto set = feed->setPose(*pose); !set)
      return named(*feed, set.error(), fmt::format("setting the pose \"{}\"", captured.name));
  }
  for (int i = 0; i < options.frames; ++i) {
    progress.at(static_cast<double>(i) / options.frames);
    auto pair = i == 0 && follower ? firstPair(a, b, *follower, pose, options, result)
                                   : nextPair(a, b, pose, options);
    if (!pair) return pair.error();
    const auto& [frame_a, frame_b] = *pair;
    if (auto added = captured.a.add(frame_a); !added) return added;
    if (auto added = captured.b.add(frame_b); !added) return added;
    if (i == 0 && result.poses.empty()) {
      for (const Feed* feed : {&a, &b}) result.warnings.push_back(feed->warning());
      for (const Frame* frame : {&frame_a, &frame_b}) {
        for (std::string& one : missingPlanes(*frame)) result.warnings.push_back(std::move(one));
      }
      result.warnings.push_back(sameSeedWarning(frame_a, frame_b));
      result.warnings.push_back(momentWarning(frame_a, frame_b));
      if (!a.isRecorded()) result.warnings.push_back(clockWarning(frame_a, a.opened()));
      if (!b.isRecorded()) result.warnings.push_back(clockWarning(frame_b, b.opened()));
      std::erase(result.warnings, "");
    }
    result.same.addA(frame_a), result.same.addB(frame_b);
    result.log.push_back(logEntry(frame_a, captured.name, "A"));
    result.log.push_back(logEntry(frame_b, captured.name, "B"));
    result.pairs.push_back({result.poses.size(), powerOn(frame_a), powerOn(frame_b),
                            medianDifference_mm(frame_a, frame_b)});
  }
  if (!pose || options.carrier == nullptr) return {};
  result.log.push_back(std::move(options.carrier->log().set("pose", captured.name).set("role", "rig")));
  return options.carrier->stillThere();
}

}  // namespace

std::optional<ClockOffset> clockOffset(const Frame& frame, std::chrono::system_clock::time_point asked) {
  using std::chrono::nanoseconds, std::chrono::system_clock;
  const bool is_recorded = frame.provenance.kind == FrameKind::Replayed;
  if (is_recorded || frame.moment.received.ns == 0) return std::nullopt;
  const system_clock::time_point received{nanoseconds{frame.moment.received.ns}};
  // How long a frame was under way is not known, as it waits for the other camera's, which may take seconds to make.
  const auto seconds = [](auto duration) { return std::chrono::duration<double>(duration).count(); };
  return ClockOffset{.low_s = seconds(received - system_clock::now()), .high_s = seconds(received - asked)};
}

std::string clockWarning(const Frame& frame, std::chrono::system_clock::time_point asked) {
  const auto ahead = clockOffset(frame, asked);
  if (!ahead || !ahead->isNotable()) return {};
  // In whole seconds, so that what is said of many captures is said once.
  return fmt::format(
      "The clock of the daemon that {} comes from is {:.0f} s or more {} ours: times of its frames are not "
      "those of other machines. Let both follow one clock (NTP).",
      frame.source, std::max(ahead->low_s, -ahead->high_s), ahead->low_s > 0.0 ? "ahead of" : "behind");
}

std::vector<std::string> missingPlanes(const Frame& frame) {
  std::vector<std::string> all;
  if (frame.find(PlaneKind::Amplitude) == nullptr) {
    all.push_back(fmt::format("{} gives no amplitude: its ratio, and whatever goes with amplitude, is not told.",
                              frame.source));
  }
  if (frame.find(PlaneKind::Flags) == nullptr) {
    all.push_back(fmt::format(
        "{} gives no flags: each of its pixels that has a range counts as valid, also where the camera may take it for "
        "saturated or wrapped.",
        frame.source));
  }
  return all;
}

Result<Frame> nextFrameAt(Feed& feed, const std::optional<Transform<World, Camera>>& pose,
                          const CaptureOptions& options) {
  return nextAt(feed, pose, options);
}

void planCapture(Progress& progress, const CaptureOptions& options) {
  // A simulated camera traces two new views first, then reads them out again and again.
  const double seconds = 12.0 + 0.1 * options.frames;
  if (options.poses.empty())
    progress.plan(fmt::format("{} frames of both cameras where they are", options.frames), seconds);
  for (const PoseSpec& pose : options.poses)
    progress.plan(fmt::format("{} frames of both cameras at \"{}\"", options.frames, pose.name),
                  seconds);
}

namespace {

/// The pose at which the cameras are to be captured: where they are to be put, or where the carrier
/// has really taken them.
Result<Transform<World, Camera>> reach(const PoseSpec& pose, const CaptureOptions& options) {
  if (options.carrier == nullptr) return pose.world_from_camera();
  auto reached = options.carrier->go(pose);
  if (reached) return reached;
  return Error{reached.error().code, fmt::format("nothing was captured at \"{}\": {}", pose.name,
                                                 reached.error().message)};
}

Result<Capture> captureAll(Feed& a, Feed& b, std::optional<Follower>& follower, const CaptureOptions& options,
                           Progress& progress) {
  Capture result{
      .a = a.details(), .b = b.details(), .poses = {}, .pairs = {}, .log = {}, .warnings = {}};
  const std::size_t count = std::max<std::size_t>(1, options.poses.size());
  bool unknown_pose = false;
  for (std::size_t i = 0; i < count; ++i) {
    progress.begin();
    CapturedPose captured{
        .name = options.poses.empty() ? "where they are" : options.poses[i].name,
        .asked = {},
        .a = {},
        .b = {}};
    if (!options.poses.empty()) {
      auto reached = reach(options.poses[i], options);
      if (!reached) return reached.error();
      captured.asked = *reached;
    }
    if (auto done = capturePose(a, b, follower, options, progress, captured, result); !done)
      return done.error();
    unknown_pose = unknown_pose || !captured.a.pose() || !captured.b.pose();
    result.poses.push_back(std::move(captured));
  }
  if (unknown_pose) {
    result.warnings.emplace_back(
        "At least one camera does not say its pose: that both stood at the same place is taken on "
        "trust.");
  }
  return result;
}

/// Puts the camera where it stood before; otherwise says why it did not work.
std::string putBack(Feed& feed) {
  const SourceDetails& before = feed.details();
  if (!before.can_set_pose) return {};
  if (!before.world_from_camera) {
    return fmt::format("{} was left at the last pose, because where it stood before is not known.",
                       before.entry.name);
  }
  if (auto set = feed.setPose(*before.world_from_camera); !set) {
    return fmt::format("{} was left at the last pose: it could not be put back: {}.",
                       before.entry.name, set.error().message);
  }
  return {};
}

}  // namespace

Result<Capture> capture(Feed& a, Feed& b, const CaptureOptions& options, Progress& progress) {
  std::optional<Follower> follower;
  if (options.twin != nullptr) follower.emplace(*options.twin);
  auto result = captureAll(a, b, follower, options, progress);
  for (std::string& why : follower ? follower->putBack() : std::vector<std::string>{}) {
    if (result) result->warnings.push_back(std::move(why));
  }
  if (options.poses.empty()) return result;
  for (Feed* feed : {&a, &b}) {
    if (std::string why = putBack(*feed); !why.empty() && result)
      result->warnings.push_back(std::move(why));
  }
  return result;
}

}  // namespace toftwin::compare
