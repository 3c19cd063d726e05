// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include <toftwin/clock.h>
#include <toftwin/units.h>

#include "drivers/pace.h"

/// A device's clock and the host's, which are never the same clock: how they relate, learnt from
/// frames that carry a stamp of the device and whose arrival the host saw.
namespace toftwin::drivers {

/// A line through (device time, host time − device time) that a minority of late arrivals does not
/// move. Bisquare M-estimate; its start is the median slope between points half a window apart.
///   delay_i = a + b x_i + noise_i,   x_i: device time relative to the newest
///   minimise Σ ρ(noise_i / s),   ψ = ρ',   ψ(u) = u (1 − (u/c)²)² for |u| < c, else 0
///   s = 1.4826 median |noise|,   c = 4.685 (95 % efficient for normal noise)
///   var(a, b) = s² [Σψ²/(n−2)] / [Σψ'/n]² (XᵀX)⁻¹                        [Huber & Ronchetti, §7.6]
/// |b| is at most a thousandth: so much no crystal is off.
/// What it cannot see is the part of the delay that is always there: that belongs to the caller.
class ClockFit {
 public:
  struct Estimate {
    std::int64_t host_minus_device_ns = 0;  ///< at the newest point
    double offset_sd_ns = 0.0;
    double drift = 0.0;  ///< host seconds gained per device second; 1e-6 is 1 ppm
    double drift_sd = 0.0;
    double noise_ns = 0.0;  ///< s: how much single arrivals scatter
  };

  static constexpr std::size_t kFewest = 8;
  explicit ClockFit(std::size_t window = 256) : window_(window) {}

  void add(DeviceTime device, std::int64_t host_ns);
  void clear() { points_.clear(); }
  /// Nothing before there are kFewest points at different times.
  [[nodiscard]] std::optional<Estimate> estimate() const;

 private:
  struct Point {
    std::int64_t device_ns, host_minus_device_ns;
  };
  std::size_t window_;
  std::deque<Point> points_;
};

/// Reads a device's stamps: counters that wrap around become a time that goes on, and a clock that
/// somebody sets, or that starts anew, is noticed and evened out, so that device time strictly
/// increases and keeps its rate. The host's side is the steady clock, which nobody sets.
class DeviceClock {
 public:
  struct Options {
    std::int64_t wraps_after_ns = 0;  ///< 0: it does not
    Duration tolerance = 500_ms;      ///< what deviates more than that may be a step of the clock
    std::size_t window = 256;         ///< frames that the relation is estimated from
    /// A clock that follows a master is set to the master's time some seconds after it began to: then steps
    /// ahead that two frames agree on are not evened out, so that devices of one master have one time. Steps
    /// back are, for device time increases.
    bool follows_steps_ahead = false;
  };
  explicit DeviceClock(Options options)
      : options_(options),
        tolerance_ns_(static_cast<std::int64_t>(options.tolerance.in(nanosecond))),
        fit_(options.window) {}

  /// Device time of a frame with that stamp which arrived then. Frames come in the order taken.
  DeviceTime read(std::int64_t stamp_ns, SteadyTime arrived);

  /// The relation to the host's wall clock at the newest frame, if a frame is under way for `delay`
  /// with a standard deviation of `delay_sd`. Unknown until there are ClockFit::kFewest frames.
  [[nodiscard]] ClockRelation relation(Duration delay, Duration delay_sd) const;
  [[nodiscard]] std::optional<ClockFit::Estimate> estimate() const { return fit_.estimate(); }
  /// How often the device's clock was set, or started anew.
  [[nodiscard]] std::uint64_t steps() const { return steps_; }

 private:
  struct Reading {
    std::int64_t time_ns = 0;
    bool is_ordinary = true;  ///< the relation may be learnt from it
  };
  Reading continued(std::int64_t stamp_ns, std::int64_t arrived_ns);
  [[nodiscard]] std::int64_t predictedStamp(std::int64_t arrived_ns,
                                            const std::optional<ClockFit::Estimate>& fitted) const;
  void step(std::int64_t by_ns);

  Options options_;
  std::int64_t tolerance_ns_;
  ClockFit fit_;  // of continuous device time and the steady clock
  std::optional<DeviceTime> last_;
  std::int64_t last_arrived_ns_ = 0;
  std::int64_t shift_ns_ = 0;  // continuous device time − stamp
  std::uint64_t steps_ = 0;
  std::size_t settling_ = 0;  // frames in which the line still knows the time before the step
  // Frames in a row that came late, or whose clock was set back by less than the pause before them.
  int behind_ = 0;
  std::int64_t behind_by_ns_ = 0, behind_since_ns_ = 0;
  std::optional<std::int64_t> ahead_by_ns_;  // the last frame, of a clock whose steps ahead are followed
};

}  // namespace toftwin::drivers
