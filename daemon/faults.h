// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>
#include <toftwin/units.h>

#include "drivers/pace.h"
#include "drivers/source.h"
#include "protocol/settings/settings.h"

namespace toftwin::daemon {

enum class FaultKind {
  Loss,
  Duplicate,
  Reorder,
  Delay,
  Corruption,
  ClockStep,
  Freeze,
  Disconnect,
  OverTemperature,
  StuckPixels,
  Dirt
};
std::string_view nameOf(FaultKind kind);

/// One [[source.fault]]: what goes wrong on purpose, and at which of the source's frames.
struct FaultKeys {
  FaultKind kind = FaultKind::Loss;
  std::uint64_t first = 0;
  std::uint64_t frames = 1;
  std::uint64_t every = 0;
  double probability = 1.0;
  std::uint64_t seed = 1;
  double share = 0.01;
  Duration delay = 100_ms;
  Duration step = 1_s;
  Duration outage = 1_s;
  Temperature temperature = 95_degC;

  template <class Visitor>
  void visit(Visitor& v) {
    v.choice("kind", kind,
             {{"loss", FaultKind::Loss},
              {"duplicate", FaultKind::Duplicate},
              {"reorder", FaultKind::Reorder},
              {"delay", FaultKind::Delay},
              {"corruption", FaultKind::Corruption},
              {"clock_step", FaultKind::ClockStep},
              {"freeze", FaultKind::Freeze},
              {"disconnect", FaultKind::Disconnect},
              {"over_temperature", FaultKind::OverTemperature},
              {"stuck_pixels", FaultKind::StuckPixels},
              {"dirt", FaultKind::Dirt}},
             "what goes wrong");
    v.number("first", first, {0, 1e15},
             "the first frame that it may strike, counted from 0 over all that the device gave since the "
             "daemon runs");
    v.number("frames", frames, {0, 1e15}, "how many frames in a row; 0: all from then on");
    v.number("every", every, {0, 1e15}, "again after so many frames, counted from first; 0: once");
    v.number("probability", probability, {0.0, 1.0}, "of each of those frames, by seed and frame");
    v.number("seed", seed, {0, 9'007'199'254'740'992.0}, "of what is random in it");
    v.number("share", share, {0.0, 1.0}, "corruption, stuck_pixels, dirt: of the pixels");
    v.quantity("delay", delay, millisecond, {0.0, 60'000.0}, "delay: how much later the frame comes");
    v.quantity("step", step, second, {0.0, 1e6}, "clock_step: how far device time jumps ahead");
    v.quantity("outage", outage, second, {0.0, 86'400.0}, "disconnect: how long the device cannot be opened");
    v.quantity("temperature", temperature, celsius, {-40.0, 300.0},
               "over_temperature: what the illumination is said to have");
  }
};

/// The faults of one source, over all the times that it is opened. Used on the source's thread, one after
/// another.
class FaultPlan {
 public:
  FaultPlan(std::vector<FaultKeys> faults, std::string source, std::filesystem::path log);

  [[nodiscard]] bool isEmpty() const { return faults_.empty(); }
  /// Opens the device, unless it is away on purpose, and puts the plan before it.
  static Result<std::unique_ptr<drivers::Source>> open(const std::shared_ptr<FaultPlan>& plan,
                                                       Result<std::unique_ptr<drivers::Source>> opened);
  /// Error Disconnected while the device is away on purpose.
  [[nodiscard]] Result<> mayOpen() const;

  /// The numbers of the faults that strike the next frame, which is counted.
  struct Strike {
    std::uint64_t frame = 0;
    std::vector<std::size_t> faults;
  };
  Strike next();
  [[nodiscard]] const FaultKeys& fault(std::size_t number) const { return faults_[number]; }
  /// A line of the file, which proves the fault: frame, device time, kind, detail. The first of a row is told
  /// in the daemon's log, too.
  void note(std::uint64_t frame, std::size_t number, std::int64_t device_ns, std::string_view detail);
  void sendAway(Duration outage);
  void stepClock(Duration step);
  [[nodiscard]] std::int64_t clockStep_ns() const { return clock_step_ns_; }

 private:
  const std::vector<FaultKeys> faults_;
  const std::string source_;
  const std::filesystem::path log_path_;
  std::ofstream log_;  ///< from the first fault on: a plan that is only checked writes nothing
  /// The frames that a fault strikes one after another, whether or not it happens to each of them.
  struct Row {
    std::uint64_t next = 0;
    bool is_told = false;
  };
  std::vector<Row> rows_;  ///< of each fault
  std::uint64_t frames_ = 0;
  std::int64_t clock_step_ns_ = 0;
  drivers::SteadyTime away_until_{};
};

/// What a fault does to a frame's pixels; `number` tells faults of one plan apart. Gives how many it changed.
std::size_t damagePixels(Frame& frame, const FaultKeys& fault, std::uint64_t index, std::size_t number);

/// 64 random bits of a fault, a frame and a place: the same on every machine.
std::uint64_t faultBits(std::uint64_t seed, std::uint64_t number, std::uint64_t frame, std::uint64_t place);

}  // namespace toftwin::daemon
