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

}  // namespace toftwin::drivers::aravis
