// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/capture.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include <toftwin/names.h>
#include <toftwin/nan.h>

#include "calib/compare/characteristics.h"
#include "calib/compare/statistics.h"
#include "protocol/record/recording.h"

namespace toftwin::compare {
namespace {

class ClientFeed final : public Feed {
 public:
  ClientFeed(Client& client, std::string source, SourceDetails details, SubscribeOptions options,
             Subscription subscription)
      : client_(client),
        source_(std::move(source)),
        details_(std::move(details)),
        options_(std::move(options)),
        subscription_(std::move(subscription)) {}
  [[nodiscard]] const SourceDetails& details() const override { return details_; }
  Result<Frame> next(std::chrono::milliseconds timeout) override {
    auto frame = subscription_.next(timeout);
    // It may have been in the making when the subscription began.
    if (frame && std::exchange(is_first_dubious_, false)) frame = subscription_.next(timeout);
    return frame;
  }
  Result<> beginAnew() override {
    if (details_.can_lockstep) return {};  // makes a frame when we ask, and not before
    auto again = client_.subscribe(source_, options_);
    if (!again) return again.error();
    subscription_ = *std::move(again);
    is_first_dubious_ = true;
    return {};
  }
  Result<> setPose(const Transform<World, Camera>& pose) override {
    return client_.setPose(source_, pose);
  }
  Result<> setParameter(std::string_view name, double value) override {
    return client_.setParameter(source_, name, value);
  }

 private:
  Client& client_;
  std::string source_;
  SourceDetails details_;
  SubscribeOptions options_;
  Subscription subscription_;
  bool is_first_dubious_ = false;
};

class RecordingFeed final : public Feed {
 public:
  RecordingFeed(record::Reader reader, SourceDetails details)
      : reader_(std::move(reader)), details_(std::move(details)) {}
  [[nodiscard]] const SourceDetails& details() const override { return details_; }
  Result<Frame> next(std::chrono::milliseconds) override {
    return reader_.next(details_.entry.name);
  }
  Result<> setPose(const Transform<World, Camera>&) override {
    return Error{Error::Code::Unsupported, "a recording cannot be moved"};
  }
  [[nodiscard]] std::string warning() const override {
    const std::string& damage = reader_.summary().damage;
    return damage.empty()
               ? ""
               : fmt::format("The recording of {} is damaged: {}. Only what can be read of it is compared.",
                             details_.entry.name, damage);
  }

 private:
  record::Reader reader_;
  SourceDetails details_;
};

Error named(const Feed& feed, const Error& error, const std::string& doing) {
  return {error.code, fmt::format("{}: {}: {}", feed.details().entry.name, doing, error.message)};
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

/// The next frame of that pose; frames of other poses are skipped.
Result<Frame> nextAt(Feed& feed, const std::optional<Transform<World, Camera>>& pose,
                     const CaptureOptions& options) {
  for (int skipped = 0; skipped <= options.most_skipped; ++skipped) {
    auto frame = nextFrame(feed, options);
    if (!frame) return named(feed, frame.error(), "waiting for a frame");
    auto& there = frame->moment.world_from_camera;
    if (pose && !there && options.carrier != nullptr) there = pose;  // the rig knows
    if (!pose || !there || samePose(*pose, *there)) return frame;
  }
  return Error{Error::Code::Timeout,
               fmt::format("{}: none of {} frames was taken at the pose asked for. A recording "
                           "must have been made with "
                           "the same pose file; a camera on a rig must be moved there.",
                           feed.details().entry.name, options.most_skipped)};
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
Result<> capturePose(Feed& a, Feed& b, const CaptureOptions& options, Progress& progress,
                     CapturedPose& captured, Capture& result) {
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
    auto pair = nextPair(a, b, pose, options);
    if (!pair) return pair.error();
    const auto& [frame_a, frame_b] = *pair;
    if (auto added = captured.a.add(frame_a); !added) return added;
    if (auto added = captured.b.add(frame_b); !added) return added;
    if (i == 0 && result.poses.empty()) {
      for (const Feed* feed : {&a, &b}) result.warnings.push_back(feed->warning());
      result.warnings.push_back(clockWarning(frame_a, a.opened()));
      result.warnings.push_back(clockWarning(frame_b, b.opened()));
      std::erase(result.warnings, "");
    }
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

Result<> Feed::setParameter(std::string_view name, double) {
  return Error{Error::Code::Unsupported, fmt::format("{}: has no parameter {}", details().entry.name, name)};
}

std::string clockWarning(const Frame& frame, std::chrono::system_clock::time_point opened) {
  using std::chrono::nanoseconds, std::chrono::system_clock;
  const bool is_recorded = frame.provenance.kind == FrameKind::Replayed;
  if (is_recorded || frame.moment.received.ns == 0) return {};
  const system_clock::time_point received{nanoseconds{frame.moment.received.ns}};
  // How long a frame was under way is not known, as it waits for the other camera's, which may take seconds to make.
  const std::chrono::duration<double> ahead = received - system_clock::now(), behind = opened - received;
  if (std::max(ahead, behind) <= std::chrono::seconds{1}) return {};
  // In whole seconds, so that what is said of many captures is said once.
  return fmt::format(
      "The clock of the daemon that {} comes from is {:.0f} s or more {} ours: times of its frames are not "
      "those of other machines. Let both follow one clock (NTP)",
      frame.source, std::max(ahead, behind).count(), ahead > behind ? "ahead of" : "behind");
}

Result<Frame> nextFrameAt(Feed& feed, const std::optional<Transform<World, Camera>>& pose,
                          const CaptureOptions& options) {
  return nextAt(feed, pose, options);
}

Result<std::unique_ptr<Feed>> openFeed(Client& client, const std::string& source,
                                       const std::vector<PlaneKind>& more) {
  auto details = client.describe(source);
  if (!details) return details.error();
  SubscribeOptions options;
  // Not Lossless: a fast camera's frames would pile up while the other one traces a pose, end with
  // Overrun at the daemon's memory limit, and before that be seconds old when they are paired.
  options.policy = details->can_lockstep ? SubscribeOptions::Policy::Lockstep
                                         : SubscribeOptions::Policy::Latest;
  // What the comparison reads; raw samples and phasors would only cost bandwidth.
  for (const PlaneKind kind : details->planes) {
    if (kind == PlaneKind::Range || kind == PlaneKind::Depth || kind == PlaneKind::Amplitude ||
        kind == PlaneKind::Flags || std::ranges::find(more, kind) != more.end())
      options.planes.push_back(kind);
  }
  const auto isRange = [](PlaneKind kind) { return kind == PlaneKind::Range || kind == PlaneKind::Depth; };
  if (std::ranges::none_of(options.planes, isRange)) {
    return Error{
        Error::Code::Unsupported,
        fmt::format("{}: gives neither range nor depth, so there is nothing to compare", source)};
  }
  auto subscription = client.subscribe(source, options);
  if (!subscription) return subscription.error();
  return std::unique_ptr<Feed>{
      std::make_unique<ClientFeed>(client, source, *std::move(details), std::move(options), *std::move(subscription))};
}

Result<std::unique_ptr<Feed>> openRecording(const std::string& file_and_source) {
  const std::size_t hash = file_and_source.rfind('#');
  const std::string file = file_and_source.substr(0, hash);
  std::string source = hash == std::string::npos ? "" : file_and_source.substr(hash + 1);
  auto reader = record::Reader::open(file);
  if (!reader) return reader.error();
  const auto& sources = reader->summary().frames_per_source;
  std::string known;
  for (const auto& [name, frames] : sources) known += (known.empty() ? "" : ", ") + name;
  if (source.empty() && sources.size() == 1) source = sources.begin()->first;
  if (!sources.contains(source)) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} holds the sources {}; name one as {}#SOURCE", file,
                             known.empty() ? "(none)" : known, file)};
  }
  auto first = reader->next(source);
  if (!first) return first.error();
  reader->rewind();
  SourceDetails details;
  details.entry = {
      .name = source,
      .model = fmt::format("recording {}", std::filesystem::path{file}.filename().string()),
      .serial = {},
      .kind = FrameKind::Replayed};
  details.driver = "recording";
  details.camera = first->camera;
  return std::unique_ptr<Feed>{
      std::make_unique<RecordingFeed>(*std::move(reader), std::move(details))};
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

Result<Capture> captureAll(Feed& a, Feed& b, const CaptureOptions& options, Progress& progress) {
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
    if (auto done = capturePose(a, b, options, progress, captured, result); !done)
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
  auto result = captureAll(a, b, options, progress);
  if (options.poses.empty()) return result;
  for (Feed* feed : {&a, &b}) {
    if (std::string why = putBack(*feed); !why.empty() && result)
      result->warnings.push_back(std::move(why));
  }
  return result;
}

}  // namespace toftwin::compare
