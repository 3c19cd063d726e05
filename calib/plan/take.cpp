// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/take.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "calib/compare/follow.h"

namespace toftwin::plan {
namespace {

using compare::Feed;

using compare::kAmbient;
using compare::kExposure;
using compare::kSincePowerOn;
using compare::longestExposure;
using compare::takes;
/// A camera may round an exposure to what its clock can do.
constexpr double kExposureTolerance = 0.05;
/// So many frames may still have the exposure from before.
constexpr int kStaleFrames = 100;

const std::string& nameOf(const Feed& feed) { return feed.details().entry.name; }

/// ns, of the camera's own clock.
std::optional<std::int64_t> startOf(const Frame& frame) {
  if (frame.moment.exposures.empty()) return std::nullopt;
  return frame.moment.exposures.front().start.ns;
}

bool isExposedAsPlanned(const Frame& frame, Duration wanted) {
  const auto there = longestExposure(frame);
  return !there || wanted == Duration{} ||
         std::abs(there->in(second)-wanted.in(second)) <= kExposureTolerance * wanted.in(second);
}

/// Of a clock that is off: said once, and again only where it cannot be as it was said any more.
bool isNews(const std::optional<compare::ClockOffset>& clock, const std::optional<compare::ClockOffset>& told) {
  return clock && clock->isNotable() && !(told && told->mayBe(*clock));
}

Error naming(const PlannedCapture& planned, const Error& error) {
  return {error.code, fmt::format("capture {} (\"{}\"): {}", planned.number, planned.name, error.message)};
}

}  // namespace

/// The pose of a camera's frames: as it says itself, which is not always what was seen.
std::optional<Transform<World, Camera>> Taker::saidBy(const Feed& feed, const Taken& taken) const {
  const auto found = says_.find(&feed);
  return found == says_.end() ? taken.pose : found->second;
}

compare::CaptureOptions Taker::captureOptions() const {
  compare::CaptureOptions options;
  options.timeout = options_.timeout;
  options.interrupted = options_.interrupted;
  options.carrier = options_.carrier;
  return options;
}

Result<> Taker::tell(const std::string& about, const std::string& what) {
  if (told_[about] == what) return {};
  if (auto done = options_.person->doThis(what); !done) return done;
  told_[about] = what;
  return {};
}

Result<> Taker::prepare(const PlannedCapture& planned) {
  if (block_ == planned.block) return {};
  const BlockSpec& block = plan_.blocks[planned.block];
  if (!block.setup.empty()) {
    if (auto done = options_.person->doThis(fmt::format("Before \"{}\": {}", block.name, block.setup)); !done)
      return done;
  }
  block_ = planned.block;
  last_began_.reset();
  return {};
}

/// A simulated camera's clock is set to the plan's; for a real one we wait.
Result<> Taker::waitForTurn(const PlannedCapture& planned, Feed& a) {
  if (!began_) began_ = options_.now();
  if (takes(a, kSincePowerOn)) {
    const Duration on = options_.powered_on_for.value_or(Duration{}) + planned.start;
    return a.setParameter(kSincePowerOn, on.in(second));
  }
  const auto interval = std::chrono::duration<double>{plan_.blocks[planned.block].interval.in(second)};
  while (last_began_ && options_.now() - *last_began_ < interval) {
    if (options_.interrupted && options_.interrupted()) return Error{Error::Code::Stopped, "interrupted"};
    options_.sleep(std::min(interval, std::chrono::duration<double>{0.05}));
  }
  last_began_ = options_.now();
  return {};
}

Result<> Taker::standBy(const compare::PoseSpec& pose, Feed& feed, Taken& taken) {
  if (feed.details().can_set_pose) return feed.setPose(*taken.pose);
  taken.pose_by = options_.carrier != nullptr ? "rig" : "person";
  if (options_.carrier != nullptr) return {};
  const auto& t = taken.pose->translation_m;
  return tell("pose of " + nameOf(feed),
              fmt::format("Bring {} to \"{}\": its lens at x {:.4g}, y {:.4g}, z {:.4g} m", nameOf(feed),
                          pose.name, t.x, t.y, t.z));
}

Result<> Taker::stand(const PlannedCapture& planned, Feed& a, Feed& b, Taken& taken) {
  if (!planned.pose) return {};
  taken.pose = planned.pose->world_from_camera();
  taken.pose_by = "camera";
  says_.clear();
  if (options_.carrier != nullptr) {
    auto reached = options_.carrier->go(*planned.pose);
    if (!reached) return Error{reached.error().code, "nothing was captured: " + reached.error().message};
    taken.pose = *reached;
  }
  for (Feed* feed : {&a, &b}) {
    if (auto done = standBy(*planned.pose, *feed, taken); !done) return done;
  }
  return {};
}

/// Exposure and ambient light: by a command where the camera takes one, else by a person.
Result<> Taker::setUp(const PlannedCapture& planned, Feed& feed, const std::string& ambient_told) {
  auto& set = set_[nameOf(feed)];
  const auto command = [&](const char* name, double value) -> Result<> {
    if (const auto old = set.find(name); old != set.end() && old->second == value) return {};
    if (auto done = feed.setParameter(name, value); !done) {
      return Error{done.error().code,
                   fmt::format("{}: {}; a block that this camera cannot do is left out with --skip",
                               nameOf(feed), done.error().message)};
    }
    set[name] = value;
    return {};
  };
  const double exposure = planned.exposure.in(microsecond), ambient = planned.ambient.in(kilolux);
  if (takes(feed, kAmbient)) {
    if (auto done = command(kAmbient, ambient); !done) return done;
  } else if (!ambient_told.empty()) {
    if (auto done = tell("ambient", ambient_told); !done) return done;
  }
  if (planned.exposure == Duration{}) return {};
  if (takes(feed, kExposure)) return command(kExposure, exposure);
  return tell("exposure of " + nameOf(feed),
              fmt::format("Set the exposure of {} to {:.6g} us", nameOf(feed), exposure));
}

/// The first frame of a subscription in lockstep is made at once, perhaps before what is set next: it is left out
/// whatever it says, so that the frames kept have the same numbers, and with them the same noise and the same time of
/// the scene, in each run. And a camera that is put elsewhere in no time has what it saw there before still in its
/// pixels, which one that is carried has long forgotten: that shows where it is meant to, in blocks of kind
/// bright_dark.
Result<> Taker::dropFirst(const PlannedCapture& planned, Feed& feed, const Taken& taken) {
  if (!feed.details().can_lockstep) return {};
  const bool is_new = known_.insert(&feed).second;
  if (is_new) {
    if (auto at_once = compare::nextFrameAt(feed, std::nullopt, captureOptions()); !at_once) return at_once.error();
  }
  if (!is_new && plan_.blocks[planned.block].kind == Kind::BrightDark) return {};
  const auto early = compare::nextFrameAt(feed, saidBy(feed, taken), captureOptions());
  return early ? Result<>{} : early.error();
}

Result<TakenBy> Taker::framesOf(const PlannedCapture& planned, Feed& feed, const Taken& taken,
                                const Sink& sink, const std::optional<Duration>& since_power_on,
                                std::optional<Frame>* first) {
  const auto asked = std::chrono::system_clock::now();  // a feed is kept for the whole run, its frames are not
  if (auto anew = feed.beginAnew(); !anew) return anew.error();
  std::optional<std::int64_t> begun;  // where the camera says no time since power-on: the first frame's start
  TakenBy by{.source = nameOf(feed), .model = feed.details().entry.model};
  const auto options = captureOptions();
  for (int stale = 0; by.frames < static_cast<std::uint64_t>(planned.frames);) {
    auto frame = compare::nextFrameAt(feed, saidBy(feed, taken), options);
    if (!frame) return frame.error();
    if (takes(feed, kExposure) && !isExposedAsPlanned(*frame, planned.exposure)) {
      if (++stale <= kStaleFrames && by.frames == 0) continue;
      return Error{
          Error::Code::InvalidArgument,
          fmt::format("{} was set to an exposure of {:.6g} us, but its frames say {:.6g} us", nameOf(feed),
                      planned.exposure.in(microsecond), longestExposure(*frame)->in(microsecond))};
    }
    // What the cameras saw counts for more than what one says of itself.
    if (!frame->moment.world_from_camera || taken.seen) frame->moment.world_from_camera = taken.pose;
    if (!frame->moment.since_power_on && since_power_on) {
      const auto start = startOf(*frame);
      if (!begun) begun = start;
      const bool is_known = start && begun && *start >= *begun;
      const std::int64_t passed_ns = is_known ? *start - *begun : 0;
      frame->moment.since_power_on = *since_power_on + 1e-9 * static_cast<double>(passed_ns) * second;
    }
    if (by.frames == 0) {
      by.since_power_on = frame->moment.since_power_on, by.temperatures = frame->moment.temperatures;
      by.ambient = frame->moment.ambient, by.exposure = longestExposure(*frame);
      by.clock = compare::clockOffset(*frame, asked);
      by.clock_warning = compare::clockWarning(*frame, asked);
      if (first != nullptr) *first = *frame;
    }
    if (auto done = sink(*frame); !done) return done.error();
    ++by.frames;
  }
  return by;
}

/// The twin at the moment of the camera that it is held against.
Result<> Taker::follow(const PlannedCapture& planned, const Frame& leader, Feed& feed, Taken& taken) {
  for (const auto& [parameter, value] : compare::settingsOf(leader, options_.carrier)) {
    const bool is_planned = std::string_view{parameter} == kExposure && planned.exposure != Duration{};
    if (is_planned || !takes(feed, parameter)) continue;
    if (auto done = feed.setParameter(parameter, value); !done)
      taken.notes.push_back(fmt::format("{} did not follow: {}", nameOf(feed), done.error().message));
    else
      set_[nameOf(feed)][parameter] = value;
  }
  if (!leader.moment.since_power_on && takes(feed, kSincePowerOn))
    taken.notes.push_back(
        fmt::format("{} does not say how long it has been on, so {} is not told; --powered-on-for says it",
                    leader.source, nameOf(feed)));
  return {};
}

Result<Taken> Taker::take(const PlannedCapture& planned, Feed& a, Feed& b, const Sink& to_a,
                          const Sink& to_b) {
  Taken taken;
  const std::string light = fmt::format("Set the ambient light to {:.6g} klx", planned.ambient.in(kilolux));
  const bool has_light =
      std::ranges::any_of(plan_.blocks, [](const BlockSpec& one) { return !one.ambients.empty(); });
  if (auto done = prepare(planned); !done) return naming(planned, done.error());
  if (auto done = stand(planned, a, b, taken); !done) return naming(planned, done.error());
  for (Feed* feed : {&a, &b}) {
    if (auto done = setUp(planned, *feed, has_light ? light : ""); !done)
      return naming(planned, done.error());
  }
  for (Feed* feed : {&a, &b}) {
    if (auto done = dropFirst(planned, *feed, taken); !done) return naming(planned, done.error());
  }
  if (auto done = lookAround(planned, a, b, taken); !done) return naming(planned, done.error());
  if (auto done = waitForTurn(planned, a); !done) return naming(planned, done.error());
  taken.began_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
                       std::chrono::system_clock::now().time_since_epoch())
                       .count();
  std::optional<Duration> on;
  if (options_.powered_on_for) {
    on = *options_.powered_on_for + std::chrono::duration<double>(options_.now() - *began_).count() * second;
  }
  std::optional<Frame> first, first_of_b;
  auto by_a = framesOf(planned, a, taken, to_a, on, &first);
  if (!by_a) return naming(planned, by_a.error());
  taken.a = *std::move(by_a);
  if (auto done = follow(planned, *first, b, taken); !done) return naming(planned, done.error());
  auto by_b = framesOf(planned, b, taken, to_b, taken.a.since_power_on, &first_of_b);
  if (!by_b) return naming(planned, by_b.error());
  taken.b = *std::move(by_b);
  std::string one_seed = compare::sameSeedWarning(*first, *first_of_b);
  if (!one_seed.empty() && !std::exchange(is_seed_told_, true)) taken.notes.push_back(std::move(one_seed));
  for (const auto& [by, told] : {std::pair{&taken.a, &clock_told_a_}, std::pair{&taken.b, &clock_told_b_}}) {
    if (!isNews(by->clock, *told)) continue;
    *told = by->clock;
    taken.notes.push_back(by->clock_warning);
  }
  if (options_.carrier == nullptr || !planned.pose) return taken;
  taken.rig = options_.carrier->log();
  if (auto there = options_.carrier->stillThere(); !there) return naming(planned, there.error());
  return taken;
}

std::vector<std::string> Taker::putBack(Feed& feed) {
  std::vector<std::string> problems;
  const SourceDetails& before = feed.details();
  const auto complain = [&](const Result<>& done) {
    if (!done)
      problems.push_back(
          fmt::format("{} was left as it was at the last capture: {}", nameOf(feed), done.error().message));
  };
  if (before.can_set_pose && before.world_from_camera) complain(feed.setPose(*before.world_from_camera));
  for (const auto& [name, value] : set_[nameOf(feed)]) {
    const auto found = std::ranges::find(before.parameters, name, &Parameter::name);
    if (found != before.parameters.end() && found->value && *found->value != value) {
      complain(feed.setParameter(name, *found->value));
    }
  }
  set_.erase(nameOf(feed));
  known_.erase(&feed);
  return problems;
}

}  // namespace toftwin::plan
