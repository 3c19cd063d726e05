// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

namespace toftwin::drivers::aravis {

/// Frames that a camera numbered and that did not come, where `bad` came and could not be used. Ids
/// of 16 bits wrap around from 65535 to 1, because 0 is no id.
inline std::uint64_t lostBetween(std::uint64_t last_id, std::uint64_t id, std::uint64_t bad) {
  constexpr std::uint64_t kMostShort = 65'535, kMostLost = 100'000;
  std::uint64_t steps = id - last_id;
  if (id <= last_id) {
    const bool has_wrapped = last_id <= kMostShort && last_id - id > kMostShort / 2;
    steps = has_wrapped ? id + kMostShort - last_id : 1;  // else: it began anew
  }
  return std::max<std::uint64_t>(bad, steps > 1 && steps < kMostLost ? steps - 1 : 0);
}

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
