// SPDX-License-Identifier: Apache-2.0
#include "daemon/faults.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <deque>
#include <iterator>
#include <optional>
#include <utility>

#include "drivers/logging.h"
#include "drivers/loss_reasons.h"

namespace toftwin::daemon {
namespace {

using std::chrono::steady_clock;

steady_clock::duration steadyOf(Duration duration) {
  return std::chrono::duration_cast<steady_clock::duration>(
      std::chrono::duration<double>{duration.in(second)});
}

std::int64_t nanosecondsOf(Duration duration) { return std::llround(duration.in(nanosecond)); }

std::int64_t startOf(const Frame& frame) {
  return frame.moment.exposures.empty() ? 0 : frame.moment.exposures.front().start.ns;
}

void markAs(Frame& frame, FaultKind kind) {
  frame.provenance.kind = FrameKind::Faulted;
  frame.provenance.effects.push_back(fmt::format("fault.{}", nameOf(kind)));
}

void heat(Frame& frame, Temperature temperature) {
  for (NamedTemperature& one : frame.moment.temperatures) {
    if (one.where == "illumination") {
      one.value = temperature;
      return;
    }
  }
  frame.moment.temperatures.push_back({"illumination", temperature});
}

/// A source with its plan before it: all calls go through, frames do not always. A fault is noted when it has
/// happened; where several strike one frame, those happen that can:
///   - what does not come has no other fault but the clock's; a device that goes away loses no frame besides,
///     but for one that waits for the next to overtake it
///   - the pixels are those that are frozen first, damaged then
///   - delays add up, doubles do not; while one waits for the next to overtake it, no other does
class FaultySource final : public drivers::Source {
 public:
  FaultySource(std::shared_ptr<FaultPlan> plan, std::unique_ptr<Source> inner)
      : plan_(std::move(plan)), inner_(std::move(inner)) {}

  [[nodiscard]] const drivers::SourceInfo& info() const override { return inner_->info(); }
  Result<> start() override { return inner_->start(); }
  void stop() override {
    loseWaiting("the source was stopped before it came");
    inner_->stop();
  }
  [[nodiscard]] drivers::SourceState state() const override { return inner_->state(); }
  Result<> setPose(const Transform<World, Camera>& pose) override { return inner_->setPose(pose); }
  Result<> setParameter(std::string_view name, double value) override {
    return inner_->setParameter(name, value);
  }
  Result<> setParameterText(std::string_view name, std::string_view text) override {
    return inner_->setParameterText(name, text);
  }
  Result<> trigger() override { return inner_->trigger(); }

  Result<Frame> next(std::stop_token stop, bool lockstep) override {
    while (true) {
      if (!leaving_.empty()) return takeLeaving(stop);
      Result<Frame> frame = inner_->next(stop, lockstep);
      if (!frame && frame.error().code == Error::Code::EndOfStream && !late_.empty()) {
        release();  // nothing comes that could overtake it
        continue;
      }
      if (!frame) return frame;
      if (auto gone = passSkipped(*frame)) return *std::move(gone);
      const FaultPlan::Strike strike = plan_->next();
      stepClock(strike, *frame);
      if (const auto gone = goes(strike)) {
        const std::int64_t device_ns = startOf(*frame);
        if (plan_->fault(*gone).kind == FaultKind::Disconnect) return disconnect(strike, *gone, device_ns);
        ++lost_;
        plan_->note(strike.frame, *gone, device_ns, "not given");
        continue;
      }
      damage(strike, *frame);
      drivers::addLost(*frame, std::exchange(lost_, 0), "a fault on purpose");
      send(strike, *std::move(frame));
    }
  }

 private:
  struct Note {
    std::size_t fault;
    std::string detail;
  };
  /// A frame on its way out, and what is true of it when it leaves.
  struct Waiting {
    std::uint64_t index = 0;
    Frame frame;
    Duration delay;
    std::optional<drivers::SteadyTime> due{};
    std::vector<Note> notes{};
  };

  Result<Frame> takeLeaving(const std::stop_token& stop) {
    Waiting& one = leaving_.front();
    if (one.delay > 0_s && !one.due) one.due = steady_clock::now() + steadyOf(one.delay);
    // What is interrupted loses no frame.
    if (one.due && !drivers::sleepUntil(*one.due, stop)) return Error{Error::Code::Stopped, "asked to stop"};
    noteAll(one);
    Frame frame = std::move(one.frame);
    leaving_.pop_front();
    return frame;
  }

  void noteAll(const Waiting& one, std::string_view instead = {}) {
    for (const auto& [fault, detail] : one.notes)
      plan_->note(one.index, fault, startOf(one.frame), instead.empty() ? detail : instead);
  }

  /// With all that it becomes, into the order in which frames leave.
  void send(const FaultPlan::Strike& strike, Frame frame) {
    Waiting one{strike.frame, std::move(frame), 0_s};
    std::optional<std::size_t> doubled, reordered;
    for (const std::size_t number : strike.faults) {
      const FaultKeys& fault = plan_->fault(number);
      if (fault.kind == FaultKind::Duplicate && !doubled) doubled = number;
      if (fault.kind == FaultKind::Reorder && late_.empty() && !reordered) reordered = number;
      if (fault.kind != FaultKind::Delay) continue;
      markAs(one.frame, fault.kind);
      one.delay = one.delay + fault.delay;
      one.notes.push_back({number, fmt::format("{:g} ms", fault.delay.in(millisecond))});
    }
    auto& way = reordered ? late_ : leaving_;
    way.push_back(one);
    if (doubled) {
      Waiting again{strike.frame, std::move(one.frame), 0_s};
      again.frame.dropped_by_device = 0;
      again.frame.dropped_because.clear();
      markAs(again.frame, FaultKind::Duplicate);
      again.notes.push_back({*doubled, "given twice"});
      way.push_back(std::move(again));
    }
    if (reordered) {
      late_by_ = *reordered;
    } else if (!late_.empty()) {
      late_.front().notes.push_back({late_by_, fmt::format("given after frame {}", strike.frame)});
      for (Waiting& late : late_) markAs(late.frame, FaultKind::Reorder);
      release();
    }
  }
  /// Those that wait do not come any more, and the log says so.
  void loseWaiting(std::string_view why) {
    if (!late_.empty()) late_.front().notes.push_back({late_by_, {}});
    release();
    for (const Waiting& one : leaving_) noteAll(one, why);
    leaving_.clear();
  }
  void release() {
    std::ranges::move(late_, std::back_inserter(leaving_));
    late_.clear();
  }

  /// Turns for which a simulated camera had no time are counted, too, so that number and device time of a
  /// frame are the same in every run, however fast the machine. Of their faults those happen that need no
  /// pixels. Gives the error if the device goes at one of them.
  std::optional<Error> passSkipped(const Frame& frame) {
    const bool is_late = frame.dropped_because.find(drivers::kNotInTime) != std::string::npos;
    const std::uint64_t skipped = is_late ? frame.dropped_by_device : 0;
    const std::int64_t now_ns = startOf(frame);
    const auto intervals = static_cast<std::int64_t>(skipped) + 1;
    const std::int64_t first_ns = now_ns - intervals * nanosecondsOf(info().frame_interval.value_or(0_s));
    const std::int64_t last_ns = std::exchange(last_ns_, now_ns).value_or(first_ns);
    for (std::int64_t k = 1; k < intervals; ++k) {
      const FaultPlan::Strike strike = plan_->next();
      const std::int64_t turn_ns = last_ns + k * (now_ns - last_ns) / intervals;
      for (const std::size_t number : strike.faults) {
        if (plan_->fault(number).kind == FaultKind::ClockStep) stepClock(strike, number, turn_ns);
      }
      const auto gone = goes(strike);
      if (!gone) continue;
      const std::int64_t device_ns = turn_ns + plan_->clockStep_ns();
      if (plan_->fault(*gone).kind == FaultKind::Disconnect) return disconnect(strike, *gone, device_ns);
      plan_->note(strike.frame, *gone, device_ns, "not given");
    }
    return std::nullopt;
  }

  /// `turn_ns`: of the device's own clock.
  void stepClock(const FaultPlan::Strike& strike, std::size_t number, std::int64_t turn_ns) {
    const FaultKeys& fault = plan_->fault(number);
    plan_->stepClock(fault.step);
    plan_->note(strike.frame, number, turn_ns + plan_->clockStep_ns(),
                fmt::format("{:g} s", fault.step.in(second)));
  }

  void stepClock(const FaultPlan::Strike& strike, Frame& frame) {
    for (Exposure& one : frame.moment.exposures) one.start.ns += plan_->clockStep_ns();
    for (const std::size_t number : strike.faults) {
      const FaultKeys& fault = plan_->fault(number);
      if (fault.kind != FaultKind::ClockStep) continue;
      plan_->stepClock(fault.step);
      for (Exposure& one : frame.moment.exposures) one.start.ns += nanosecondsOf(fault.step);
      markAs(frame, fault.kind);
      plan_->note(strike.frame, number, startOf(frame), fmt::format("{:g} s", fault.step.in(second)));
    }
  }

  /// The fault that keeps the frame from coming.
  [[nodiscard]] std::optional<std::size_t> goes(const FaultPlan::Strike& strike) const {
    for (const FaultKind kind : {FaultKind::Disconnect, FaultKind::Loss}) {
      const auto found = std::ranges::find_if(
          strike.faults, [&](std::size_t number) { return plan_->fault(number).kind == kind; });
      if (found != strike.faults.end()) return *found;
    }
    return std::nullopt;
  }

  Error disconnect(const FaultPlan::Strike& strike, std::size_t number, std::int64_t device_ns) {
    const Duration outage = plan_->fault(number).outage;
    loseWaiting("the device went before it came");
    plan_->sendAway(outage);
    plan_->note(strike.frame, number, device_ns, fmt::format("{:g} s", outage.in(second)));
    return {Error::Code::Disconnected,
            fmt::format("the fault plan disconnected it at frame {}", strike.frame)};
  }

  /// What is wrong with what the frame holds.
  void damage(const FaultPlan::Strike& strike, Frame& frame) {
    const auto note = [&](std::size_t number, std::string_view detail) {
      markAs(frame, plan_->fault(number).kind);
      plan_->note(strike.frame, number, startOf(frame), detail);
    };
    const auto freezes = std::ranges::find_if(
        strike.faults, [&](std::size_t number) { return plan_->fault(number).kind == FaultKind::Freeze; });
    if (freezes != strike.faults.end() && !good_.empty()) {
      frame.planes = good_;
      note(*freezes, "the pixels of the last good frame");
    } else {
      good_ = frame.planes;
    }
    for (const std::size_t number : strike.faults) {
      const FaultKeys& fault = plan_->fault(number);
      switch (fault.kind) {
        case FaultKind::OverTemperature:
          heat(frame, fault.temperature);
          note(number, fmt::format("{:g} degrees", fault.temperature.in(celsius)));
          break;
        case FaultKind::Corruption:
        case FaultKind::StuckPixels:
        case FaultKind::Dirt:
          note(number, fmt::format("{} pixels", damagePixels(frame, fault, strike.frame, number)));
          break;
        default:
          break;
      }
    }
  }

  const std::shared_ptr<FaultPlan> plan_;  // shared with the source's next opening
  const std::unique_ptr<Source> inner_;
  std::deque<Waiting> leaving_, late_;  ///< late: until the next one has left
  std::size_t late_by_ = 0;             ///< the fault
  std::vector<Plane> good_;             ///< what a frozen camera gives
  std::uint64_t lost_ = 0;
  std::optional<std::int64_t>
      last_ns_;  ///< device time of the last frame that came, without the plan's steps
};

}  // namespace

std::string_view nameOf(FaultKind kind) {
  constexpr std::array<std::string_view, 11> kNames{
      "loss",   "duplicate",  "reorder",          "delay",        "corruption", "clock_step",
      "freeze", "disconnect", "over_temperature", "stuck_pixels", "dirt"};
  return kNames[static_cast<std::size_t>(kind)];
}

FaultPlan::FaultPlan(std::vector<FaultKeys> faults, std::string source, std::filesystem::path log)
    : faults_(std::move(faults)),
      source_(std::move(source)),
      log_path_(std::move(log)),
      rows_(faults_.size()) {}

Result<> FaultPlan::mayOpen() const {
  if (steady_clock::now() >= away_until_) return {};
  return Error{Error::Code::Disconnected, "the fault plan keeps the device away"};
}

Result<std::unique_ptr<drivers::Source>> FaultPlan::open(const std::shared_ptr<FaultPlan>& plan,
                                                         Result<std::unique_ptr<drivers::Source>> opened) {
  if (!plan || plan->isEmpty() || !opened || *opened == nullptr) return opened;
  return std::unique_ptr<drivers::Source>{std::make_unique<FaultySource>(plan, *std::move(opened))};
}

FaultPlan::Strike FaultPlan::next() {
  Strike strike{frames_++, {}};
  for (std::size_t number = 0; number < faults_.size(); ++number) {
    const FaultKeys& fault = faults_[number];
    if (strike.frame < fault.first) continue;
    const std::uint64_t since = strike.frame - fault.first;
    const std::uint64_t within = fault.every > 0 ? since % fault.every : since;
    if (fault.frames > 0 && within >= fault.frames) continue;
    const double chance =
        static_cast<double>(faultBits(fault.seed, number, strike.frame, ~0ULL) >> 11) * 0x1p-53;
    if (chance >= fault.probability) continue;
    strike.faults.push_back(number);
    Row& row = rows_[number];
    if (strike.frame != row.next) row.is_told = false;
    row.next = strike.frame + 1;
  }
  return strike;
}

void FaultPlan::note(std::uint64_t frame, std::size_t number, std::int64_t device_ns,
                     std::string_view detail) {
  const FaultKeys& fault = faults_[number];
  if (!std::exchange(rows_[number].is_told, true)) {
    logging::info("{}: fault {} ({}) at frame {}, device time {} ns: {}", source_, number, nameOf(fault.kind),
                  frame, device_ns, detail);
  }
  if (log_path_.empty()) return;
  if (!log_.is_open()) {
    log_.open(log_path_);
    log_ << "frame,device_ns,fault,kind,detail\n";
    if (!log_) logging::error("{}: the log of faults {} cannot be written", source_, log_path_.string());
  }
  log_ << fmt::format("{},{},{},{},{}\n", frame, device_ns, number, nameOf(fault.kind), detail) << std::flush;
}

void FaultPlan::sendAway(Duration outage) { away_until_ = steady_clock::now() + steadyOf(outage); }

void FaultPlan::stepClock(Duration step) { clock_step_ns_ += nanosecondsOf(step); }

}  // namespace toftwin::daemon
