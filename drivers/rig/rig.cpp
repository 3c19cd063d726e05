// SPDX-License-Identifier: Apache-2.0
#include "drivers/rig/rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

#include "drivers/rig/kinematics.h"

namespace toftwin::rig {
namespace {

using Clock = std::chrono::steady_clock;
using Positions = std::vector<double>;

constexpr int kStopTries = 5;

std::chrono::nanoseconds toChrono(Duration duration) {
  return std::chrono::nanoseconds{static_cast<std::int64_t>(duration.in(nanosecond))};
}

const char* unitOf(const AxisSpec& axis) { return axis.kind == AxisKind::Linear ? "mm" : "deg"; }

/// "x at 12.3 mm, 4.5 mm short of 16.8 mm": the axis that is farthest from its target, in
/// tolerances.
std::string worstOf(const RigFile& file, const Positions& is, const Positions& targets) {
  std::size_t worst = 0;
  const auto off = [&](std::size_t i) {
    return std::abs(is[i] - targets[i]) / file.axes[i].tolerance;
  };
  for (std::size_t i = 1; i < is.size(); ++i) {
    if (off(i) > off(worst)) worst = i;
  }
  const AxisSpec& axis = file.axes[worst];
  return fmt::format("{} stands at {:.3f} {}, {:.3f} {} from its target {:.3f} {}", axis.name,
                     is[worst], unitOf(axis), std::abs(is[worst] - targets[worst]), unitOf(axis),
                     targets[worst], unitOf(axis));
}

/// Notices when no axis has moved by its tolerance for a while.
class StallWatch {
 public:
  StallWatch(const RigFile& file, Duration stall_time, Clock::time_point now)
      : file_(file), stall_time_(toChrono(stall_time)), since_(now) {}
  bool hasStalled(const Positions& is, Clock::time_point now) {
    bool has_moved = mark_.empty();
    for (std::size_t i = 0; i < mark_.size(); ++i) {
      has_moved = has_moved || std::abs(is[i] - mark_[i]) > file_.axes[i].tolerance;
    }
    if (has_moved) mark_ = is, since_ = now;
    return now - since_ > stall_time_;
  }

 private:
  const RigFile& file_;
  const std::chrono::nanoseconds stall_time_;
  Positions mark_;
  Clock::time_point since_;
};

bool isThere(const RigFile& file, const RigState& state, const Positions& targets) {
  bool is_there = state.is_in_position;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    is_there = is_there && std::abs(state.positions[i] - targets[i]) <= file.axes[i].tolerance;
  }
  return is_there;
}

}  // namespace

// ---- opening and looking -----------------------------------------------------------------------

Result<std::unique_ptr<Rig>> Rig::open(RigFile file) {
  auto bus = Bus::open(file);
  if (!bus) return bus.error();
  std::unique_ptr<Rig> rig{new Rig{std::move(file), *std::move(bus)}};
  if (auto seen = rig->state(); !seen) return seen.error();
  return rig;
}

Result<> Rig::stopNow(const RigFile& file) {
  auto bus = Bus::open(file);
  if (!bus) return bus.error();
  return Rig{file, *std::move(bus)}.stop();
}

Result<RigState> Rig::state() {
  RigState state;
  const std::pair<const Signal&, std::pair<const char*, bool&>> flags[] = {
      {file_.emergency, {"emergency", state.is_emergency}},
      {file_.stop, {"stop", state.is_stopped}},
      {file_.fault, {"fault", state.has_fault}},
      {file_.homed, {"homed", state.is_homed}},
      {file_.in_position, {"in_position", state.is_in_position}}};
  for (const auto& [signal, flag] : flags) {
    if (!signal.isThere()) continue;
    const auto is_set = bus_->isSet(signal, flag.first);
    if (!is_set) return is_set.error();
    flag.second = *is_set;
  }
  if (file_.fault_code.isThere()) {
    const auto code = bus_->read(file_.fault_code, "fault_code");
    if (!code) return code.error();
    state.fault_code = *code;
  }
  for (const AxisSpec& axis : file_.axes) {
    const auto position = bus_->read(axis.position, axis.name + ".position");
    if (!position) return position.error();
    state.positions.push_back(*position);
  }
  for (const TemperatureSpec& one : file_.temperatures) {
    const auto value = bus_->read(one.signal, one.name);
    if (!value) return value.error();
    state.temperatures.push_back({one.name, *value * celsius});
  }
  return state;
}

Transform<World, Camera> Rig::poseAt(const Positions& positions) const {
  return rig::poseAt(file_, positions);
}

Result<bool> Rig::isTriggered() {
  if (!file_.trigger.isThere()) {
    return Error{Error::Code::Unsupported, "the rig file names no signal \"trigger\""};
  }
  return bus_->isSet(file_.trigger, "trigger");
}

Result<> Rig::setCaptured(bool is_done) {
  return file_.captured.isThere() ? bus_->set(file_.captured, is_done, "captured") : Result<>{};
}

// ---- stopping ----------------------------------------------------------------------------------

Result<> Rig::stop() {
  may_release_ = true;
  Result<> stopped = bus_->set(file_.stop, true, "stop");
  for (int i = 1; i < kStopTries && !stopped; ++i) stopped = bus_->set(file_.stop, true, "stop");
  return stopped;
}

Result<> Rig::release() {
  may_release_ = false;
  return bus_->set(file_.stop, false, "stop");
}

Error Rig::halt(Error why) {
  const Result<> stopped = stop();
  why.message +=
      stopped ? ". The rig was told to stop"
              : fmt::format(". AND IT COULD NOT BE TOLD TO STOP: press the emergency stop ({})",
                            stopped.error().message);
  return why;
}

// ---- moving ------------------------------------------------------------------------------------

Result<> Rig::mayMove(const RigState& state) const {
  using Code = Error::Code;
  if (state.is_emergency) {
    return Error{Code::PermissionDenied,
                 "the rig's emergency stop is pressed; release it when nobody is in the way"};
  }
  if (state.is_stopped && !may_release_) {
    return Error{Code::Stopped, "somebody else stopped the rig"};
  }
  if (!state.has_fault) return {};
  const std::string code = state.fault_code ? fmt::format(", code {:.6g}", *state.fault_code) : "";
  return Error{
      Code::Busy,
      fmt::format("the rig's controller reports a fault{}; its manual says what that is", code)};
}

Result<> Rig::checkLimits(const Positions& positions) const {
  if (positions.size() != file_.axes.size()) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} positions for {} axes", positions.size(), file_.axes.size())};
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const AxisSpec& axis = file_.axes[i];
    if (positions[i] >= axis.min && positions[i] <= axis.max) continue;
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("{} = {:.6g} {} is beyond its soft limits, {:.6g} to {:.6g} {}", axis.name,
                    positions[i], unitOf(axis), axis.min, axis.max, unitOf(axis))};
  }
  return {};
}

/// One look at a rig in motion; an error has stopped it.
Result<RigState> Rig::look(const Interrupted& interrupted) {
  if (interrupted && interrupted()) {
    return halt({Error::Code::Stopped, "the rig's motion was interrupted"});
  }
  auto state = this->state();
  if (!state) return halt(state.error());
  auto well = mayMove(*state);
  if (!well && state->is_stopped) return well.error();  // and so it shall stay
  if (!well) return halt(well.error());
  if (file_.heartbeat.isThere()) {
    beats_ = (beats_ + 1) % 1000;
    if (auto beat = bus_->write(file_.heartbeat, beats_, "heartbeat"); !beat)
      return halt(beat.error());
  }
  return state;
}

Result<RigState> Rig::home(const Interrupted& interrupted) {
  if (!file_.home.isThere()) {
    return Error{
        Error::Code::Unsupported,
        "the rig file names no signal \"home\": this rig knows where it is, or is homed by hand"};
  }
  const auto before = state();
  if (!before) return before.error();
  if (auto may = mayMove(*before); !may) return may.error();
  if (auto released = release(); !released) return halt(released.error());
  const auto begun = bus_->set(file_.home, true, "home");
  auto homed = begun ? watchHoming(interrupted) : Result<RigState>{halt(begun.error())};
  // Taken back behind a stop, too: else the rig would home by itself when that is released, or see no new order.
  const auto ended = bus_->set(file_.home, false, "home");
  if (homed && !ended) return halt(ended.error());
  return homed;
}

Result<RigState> Rig::watchHoming(const Interrupted& interrupted) {
  const auto began = Clock::now();
  StallWatch stall{file_, file_.home_stall_time, began};
  bool has_begun = false;
  while (true) {
    std::this_thread::sleep_for(toChrono(file_.poll));
    auto state = look(interrupted);
    if (!state) return state;
    // A rig that was homed before says so until it has begun to home again, which takes it a
    // moment.
    has_begun = has_begun || !state->is_homed || Clock::now() - began > toChrono(file_.settle);
    if (has_begun && state->is_homed) return state;
    if (file_.home_stall_time > 0_s && stall.hasStalled(state->positions, Clock::now())) {
      return halt({Error::Code::Timeout,
                   fmt::format("the rig has stalled while it looked for its home: no axis has moved by its "
                               "tolerance for {:.6g} s (home_stall_time_ms)",
                               file_.home_stall_time.in(second))});
    }
    if (Clock::now() - began > toChrono(file_.home_time)) {
      return halt(
          {Error::Code::Timeout, fmt::format("the rig has not found its home within {:.6g} s",
                                             file_.home_time.in(second))});
    }
  }
}

Result<RigState> Rig::moveAxes(const Positions& positions, const Interrupted& interrupted) {
  if (auto within = checkLimits(positions); !within) return within.error();
  const auto before = state();
  if (!before) return before.error();
  if (auto may = mayMove(*before); !may) return may.error();
  if (!before->is_homed) {
    return Error{Error::Code::Busy,
                 "the rig does not know where it is; home it first: toftwin rig home"};
  }
  Positions first = positions;
  for (std::size_t i = 0; i < first.size(); ++i) {
    first[i] = std::clamp(first[i] - file_.axes[i].approach, file_.axes[i].min, file_.axes[i].max);
  }
  if (first != positions) {
    if (auto there = drive(first, interrupted); !there) return there;
  }
  return drive(positions, interrupted);
}

Result<RigState> Rig::moveTo(const Transform<World, Camera>& pose, const Interrupted& interrupted) {
  const auto now = state();
  if (!now) return now.error();
  const auto positions = positionsFor(file_, pose, now->positions);
  return positions ? moveAxes(*positions, interrupted) : positions.error();
}

Result<RigState> Rig::drive(const Positions& targets, const Interrupted& interrupted) {
  if (auto launched = launch(targets); !launched) return halt(launched.error());
  return watch(targets, interrupted);
}

/// A stop is released only when the targets are there: the rig never sets out for an old one.
Result<> Rig::launch(const Positions& targets) {
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const AxisSpec& axis = file_.axes[i];
    if (auto set = bus_->write(axis.target, targets[i], axis.name + ".target"); !set) return set;
  }
  if (auto released = release(); !released) return released;
  return file_.go.isThere() ? bus_->set(file_.go, true, "go") : Result<>{};
}

Result<RigState> Rig::watch(const Positions& targets, const Interrupted& interrupted) {
  const auto began = Clock::now();
  std::optional<Clock::time_point> there_since;
  StallWatch stall{file_, file_.stall_time, began};
  while (true) {
    std::this_thread::sleep_for(toChrono(file_.poll));
    auto state = look(interrupted);
    if (!state) return state;
    const auto now = Clock::now();
    if (isThere(file_, *state, targets)) {
      if (!there_since) there_since = now;
      if (now - *there_since >= toChrono(file_.settle)) return state;
      continue;
    }
    there_since.reset();
    const bool has_stalled = stall.hasStalled(state->positions, now);
    if (!has_stalled && now - began <= toChrono(file_.move_time)) continue;
    return halt({Error::Code::Timeout,
                 fmt::format("the rig {}: {}",
                             has_stalled ? "has stalled"
                                         : fmt::format("is not in position after {:.6g} s",
                                                       file_.move_time.in(second)),
                             worstOf(file_, state->positions, targets))});
  }
}

}  // namespace toftwin::rig
