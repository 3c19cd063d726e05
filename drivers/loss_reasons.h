// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <toftwin/frame.h>

namespace toftwin::drivers {

/// Says in a frame that `frames` before it were lost between device and daemon, and why.
void addLost(Frame& frame, std::uint64_t frames, std::string_view why);

/// Frames that were lost since the last good one, by why.
class LossReasons {
 public:
  void add(std::string_view why, std::uint64_t frames = 1);
  void add(const LossReasons& others);
  /// `skipped` frames are missing by the device's own numbers, those that were added before among them. The rest is lost
  /// for the reason `otherwise`.
  void account(std::uint64_t skipped, std::string_view otherwise);
  /// Says so in the frame that comes next, and begins anew.
  void tell(Frame& frame);
  void clear() { reasons_.clear(); }

  [[nodiscard]] std::uint64_t frames() const;
  /// "packets of it did not come (2), no buffer was free for it (1)"; empty if there are none.
  [[nodiscard]] std::string text() const;

 private:
  std::vector<std::pair<std::string, std::uint64_t>> reasons_;  // in the order met, and not many
};

}  // namespace toftwin::drivers
