// SPDX-License-Identifier: Apache-2.0
#include "daemon/faults.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>

#include "drivers/logging.h"

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

/// A source with its plan before it: all calls go through, frames do not always.
class FaultySource final : public drivers::Source {
 public:
  FaultySource(std::shared_ptr<FaultPlan> plan, std::unique_ptr<Source> inner)
      : plan_(std::move(plan)), inner_(std::move(inner)) {}

  [[nodiscard]] const drivers::SourceInfo& info() const override { return inner_->info(); }
  Result<> start() override { return inner_->start(); }
  void stop() override {
    waiting_.reset();
    inner_->stop();
  }
  [[nodiscard]] drivers::SourceState state() const override { return inner_->state(); }
  Result<> setPose(const Transform<World, Camera>& pose) override { return inner_->setPose(pose); }
  Result<> setParameter(std::string_view name, double value) override {
    return inner_->setParameter(name, value);
  }
  Result<> trigger() override { return inner_->trigger(); }

  Result<Frame> next(std::stop_token stop, bool lockstep) override {
    while (true) {
      if (waiting_) return takeWaiting(stop);
      Result<Frame> frame = inner_->next(stop, lockstep);
      if (!frame) return frame;
      const FaultPlan::Strike strike = plan_->next();
      if (auto away = apply(strike, *frame); !away) return away.error();
      if (is_lost_) {
        waiting_.reset();
        continue;
      }
      frame->dropped_by_device += std::exchange(lost_, 0);
      if (!waiting_) return frame;
      waiting_->frame = *std::move(frame);
      if (!waiting_->due) return std::as_const(*waiting_).frame;  // and once more
    }
  }

 private:
  struct Waiting {
    Frame frame;
    std::optional<drivers::SteadyTime> due;  ///< none: the second of a pair
  };

  Result<Frame> takeWaiting(const std::stop_token& stop) {
    // What is interrupted loses no frame.
    if (waiting_->due && !drivers::sleepUntil(*waiting_->due, stop))
      return Error{Error::Code::Stopped, "asked to stop"};
    Frame frame = std::move(waiting_->frame);
    if (!waiting_->due) {
      frame.dropped_by_device = 0;
      markAs(frame, FaultKind::Duplicate);
    }
    waiting_.reset();
    return frame;
  }

  /// Error Disconnected if the device goes away with this frame.
  Result<> apply(const FaultPlan::Strike& strike, Frame& frame) {
    is_lost_ = false;
    for (Exposure& one : frame.moment.exposures) one.start.ns += plan_->clockStep_ns();
    for (const std::size_t number : strike.faults) {
      const FaultKeys& fault = plan_->fault(number);
      const std::string detail = applyOne(fault, number, strike.frame, frame);
      plan_->note(strike, number, startOf(frame), detail);
      if (fault.kind == FaultKind::Disconnect) {
        return Error{Error::Code::Disconnected,
                     fmt::format("the fault plan disconnected it at frame {}", strike.frame)};
      }
    }
    if (!isStruckBy(strike, FaultKind::Freeze)) frozen_ = frame.planes;
    return {};
  }

  [[nodiscard]] bool isStruckBy(const FaultPlan::Strike& strike, FaultKind kind) const {
    return std::ranges::any_of(strike.faults,
                               [&](std::size_t number) { return plan_->fault(number).kind == kind; });
  }

  std::string applyOne(const FaultKeys& fault, std::size_t number, std::uint64_t index, Frame& frame) {
    switch (fault.kind) {
      case FaultKind::Loss:
        is_lost_ = true;
        ++lost_;
        return "not given";
      case FaultKind::Duplicate:
        if (!waiting_) waiting_.emplace();
        return "given twice";
      case FaultKind::Delay:
        markAs(frame, fault.kind);
        waiting_.emplace().due = steady_clock::now() + steadyOf(fault.delay);
        return fmt::format("{:g} ms", fault.delay.in(millisecond));
      case FaultKind::ClockStep: {
        plan_->stepClock(fault.step);
        const std::int64_t step_ns = nanosecondsOf(fault.step);
        for (Exposure& one : frame.moment.exposures) one.start.ns += step_ns;
        markAs(frame, fault.kind);
        return fmt::format("{:g} s", fault.step.in(second));
      }
      case FaultKind::Freeze:
        if (!frozen_.empty()) frame.planes = frozen_;
        markAs(frame, fault.kind);
        return "the pixels of the frame before";
      case FaultKind::Disconnect:
        plan_->sendAway(fault.outage);
        return fmt::format("{:g} s", fault.outage.in(second));
      case FaultKind::OverTemperature:
        heat(frame, fault.temperature);
        markAs(frame, fault.kind);
        return fmt::format("{:g} degrees", fault.temperature.in(celsius));
      case FaultKind::Corruption:
      case FaultKind::StuckPixels:
      case FaultKind::Dirt:
        markAs(frame, fault.kind);
        return fmt::format("{} pixels", damagePixels(frame, fault, index, number));
    }
    return {};
  }

  const std::shared_ptr<FaultPlan> plan_;  // shared with the source's next opening
  const std::unique_ptr<Source> inner_;
  std::optional<Waiting> waiting_;
  std::vector<Plane> frozen_;
  std::uint64_t lost_ = 0;
  bool is_lost_ = false;
};

}  // namespace

std::string_view nameOf(FaultKind kind) {
  constexpr std::array<std::string_view, 10> kNames{
      "loss",       "duplicate",        "delay",        "corruption", "clock_step", "freeze",
      "disconnect", "over_temperature", "stuck_pixels", "dirt"};
  return kNames[static_cast<std::size_t>(kind)];
}

FaultPlan::FaultPlan(std::vector<FaultKeys> faults, std::string source, std::filesystem::path log)
    : faults_(std::move(faults)),
      source_(std::move(source)),
      log_path_(std::move(log)),
      next_in_row_(faults_.size()) {}

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
    if (chance < fault.probability) strike.faults.push_back(number);
  }
  return strike;
}

void FaultPlan::note(const Strike& strike, std::size_t number, std::int64_t device_ns,
                     std::string_view detail) {
  const FaultKeys& fault = faults_[number];
  const bool goes_on = strike.frame > 0 && strike.frame == next_in_row_[number];
  next_in_row_[number] = strike.frame + 1;
  if (!goes_on) {
    logging::info("{}: fault {} ({}) at frame {}, device time {} ns: {}", source_, number, nameOf(fault.kind),
                  strike.frame, device_ns, detail);
  }
  if (log_path_.empty()) return;
  if (!log_.is_open()) {
    log_.open(log_path_);
    log_ << "frame,device_ns,fault,kind,detail\n";
    if (!log_) logging::error("{}: the log of faults {} cannot be written", source_, log_path_.string());
  }
  log_ << fmt::format("{},{},{},{},{}\n", strike.frame, device_ns, number, nameOf(fault.kind), detail)
       << std::flush;
}

void FaultPlan::sendAway(Duration outage) { away_until_ = steady_clock::now() + steadyOf(outage); }

void FaultPlan::stepClock(Duration step) { clock_step_ns_ += nanosecondsOf(step); }

}  // namespace toftwin::daemon
