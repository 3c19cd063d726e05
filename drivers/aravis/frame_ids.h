// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include <toftwin/clock.h>
#include <toftwin/units.h>

#include "drivers/pace.h"

namespace toftwin::drivers::aravis {

/// The numbers that a camera gives its frames, and what they say of those that did not come. A number is
/// believed as far as the camera can have taken so many frames meanwhile:
///   steps ≤ 1 + 1.25 · elapsed / interval
/// One that is not believed is damaged, or the camera began anew: then the next one goes on from it.
class FrameIds {
 public:
  struct Seen {
    std::uint64_t id = 0;
    SteadyTime arrived;
    DeviceTime taken;
  };

  /// Of a camera that takes one so often; nothing if it does not say so, as where it waits for triggers.
  explicit FrameIds(std::optional<Duration> interval) { setInterval(interval); }
  void setInterval(std::optional<Duration> interval);
  /// The next frame is the first one.
  void restart();
  /// Frames lost since the last good one, where `bad` came and could not be used.
  std::uint64_t lostBefore(const Seen& now, std::uint64_t bad);

 private:
  [[nodiscard]] std::uint64_t believed(const Seen& from, const Seen& to) const;
  void learn(double step_s);
  void adopt(const Seen& now);

  double said_s_ = 0.0, interval_s_ = 0.0;
  std::optional<Seen> last_, doubted_;
  std::uint64_t doubts_ = 0,
                told_ = 0;  ///< since the last one that was believed: not believed, and told as lost
};

/// Packets that found no buffer, which the library counts for the whole stream, frame by frame: those of a gap are of
/// the frames in it. Those of a frame that came after all, for its packets were sent again, are of no gap.
class Underruns {
 public:
  /// Since the last gap, for a frame that has just been taken, with a gap before it or not. `counted` so far;
  /// `is_newest`: no other frame is filled, so that all of them are of the time before the next one.
  std::uint64_t before(bool is_gap, std::uint64_t counted, bool is_newest) {
    if (!is_gap) told_ = settled_;
    const std::uint64_t since = counted - told_;
    if (is_gap) told_ = counted;
    settled_ = is_newest ? counted : told_;
    return since;
  }

 private:
  std::uint64_t told_ = 0;
  std::uint64_t settled_ = 0;  ///< of these, if the next frame comes without a gap
};

}  // namespace toftwin::drivers::aravis
