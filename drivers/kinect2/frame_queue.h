// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>

#include "drivers/kinect2/assembly.h"
#include "drivers/kinect2/link.h"

namespace toftwin::drivers::kinect2 {

/// Between the link's thread, which brings packets, and the source's, which fetches frames. It holds two: who
/// is slower loses the older one.
class FrameQueue final : public PacketSink {
 public:
  void packet(std::span<const std::byte> bytes) override;
  void missed() override;
  void lost(Error why) override;

  /// For a new start, while no link has it: empty, and the losses are counted from 0.
  void clear();
  /// The next frame. Errors: Timeout, Stopped, or why no more will come.
  Result<RawFrame> next(const std::stop_token& stop, SteadyTime until);
  [[nodiscard]] Losses losses() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  Assembler assembler_;
  std::deque<RawFrame> frames_;
  std::uint64_t late_ = 0;
  std::optional<Error> end_;
};

}  // namespace toftwin::drivers::kinect2
