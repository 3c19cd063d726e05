// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <stop_token>
#include <string_view>

#include <toftwin/clock.h>
#include <toftwin/result.h>
#include <toftwin/units.h>

namespace toftwin::drivers {

using SteadyTime = std::chrono::steady_clock::time_point;

/// The longest a source may wait for a frame before it says Timeout, so that whoever watches it can
/// tell waiting from being stuck.
inline constexpr std::chrono::seconds kLongestWait{1};

/// Sleeps until that time. False if asked to stop before.
bool sleepUntil(SteadyTime time, const std::stop_token& stop);

/// How a device clock that runs with the host's steady clock relates to the host's wall clock,
/// where `device` is the device's time at the steady time `at`. Reads the wall clock between two
/// readings of the steady clock; half of their distance bounds the error of the relation.
ClockRelation relateToHost(DeviceTime device, SteadyTime at);

/// What sets the pace of a source that makes its frames itself.
enum class Pace { RealTime, Fast, Trigger };

/// Why a frame that Pacer counts as lost was.
inline constexpr std::string_view kNotInTime = "not made in time";

/// Counts the frames of such a source and waits for the turn of the next. Device time is derived from
/// the count, which is never set back, so it goes on increasing over a stop and a start.
class Pacer {
 public:
  Pacer(Pace pace, Duration frame_interval);

  /// For Source::start().
  void restart();
  /// Waits until the next frame is due: in real time until its device time, or for a trigger, or not at
  /// all (Fast, lockstep). Gives how many frames were due meanwhile and are lost, as a camera would have
  /// lost them; they are counted already. Errors: Stopped, Timeout.
  Result<std::uint64_t> waitForTurn(const std::stop_token& stop, bool lockstep);
  /// Chooses the next frame's turn already now, while the present one is made: turns that are due by now are lost but
  /// for the last. waitForTurn() will say so, and count others only if the frame is a second late. Gives its device
  /// time.
  DeviceTime chooseNext();
  /// The frame was made.
  void advance();
  void trigger() { ++triggers_; }
  /// From the next frame on; device time goes on from where it is.
  void setInterval(Duration frame_interval);
  void setPace(Pace pace);

  /// Of the next frame since the source was opened, lost ones counted.
  [[nodiscard]] std::uint64_t index() const { return index_; }
  [[nodiscard]] DeviceTime deviceTime() const { return deviceTimeOf(index_); }
  /// Unknown unless the last turn was paced in real time.
  [[nodiscard]] const ClockRelation& clock() const { return clock_; }

 private:
  [[nodiscard]] DeviceTime deviceTimeOf(std::uint64_t index) const {
    return {base_ns_ + static_cast<std::int64_t>(index - base_index_) * interval_ns_};
  }
  /// In real time: since it was due; negative before.
  [[nodiscard]] std::chrono::nanoseconds lateness(std::uint64_t index, SteadyTime now) const;
  /// How many turns after it are due by then.
  [[nodiscard]] std::uint64_t turnsLost(std::uint64_t index, SteadyTime now) const;
  /// Begins the present frame. How many were lost before it.
  std::uint64_t takeTurn();

  Pace pace_;
  std::int64_t interval_ns_;
  std::uint64_t index_ = 0;
  std::uint64_t base_index_ = 0;  ///< of the first frame with this interval,
  std::int64_t base_ns_ = 0;      ///< and its device time
  std::optional<std::uint64_t> next_;  ///< chosen while the present one is made
  bool is_chosen_ = false;             ///< the present one was
  std::uint64_t lost_ = 0;             ///< for the chosen one
  std::uint64_t triggers_ = 0;
  std::optional<SteadyTime> since_;  ///< when device time 0 was, if paced in real time
  ClockRelation clock_;
};

}  // namespace toftwin::drivers
