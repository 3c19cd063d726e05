// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/struck_frames.h"

#include <boost/asio/steady_timer.hpp>

#include <fmt/format.h>

#include <chrono>
#include <vector>

namespace toftwin::daemon {
namespace {

/// That wait for their time; more of them leave at once.
constexpr std::size_t kMostWaitingFrames = 64;

Frame corrupted(Frame frame, std::uint64_t noise) {
  for (Plane& plane : frame.planes) {
    const auto bytes = plane.data.bytes();
    std::vector<std::byte> changed(bytes.begin(), bytes.end());
    LineFaults::corrupt(changed, noise);
    plane.data = Buffer::adopt(std::move(changed));
  }
  return frame;
}

}  // namespace

void StruckFrames::take(const Frame& frame) {
  if (faults_.isNone()) return put_(frame);
  const auto fate = faults_.next(fmt::format("frame {}", frame.sequence));
  if (fate.is_lost) return;
  Frame leaves = fate.is_corrupted ? corrupted(frame, fate.noise) : frame;
  if (fate.is_late && !late_) {
    late_ = std::move(leaves);
    return;
  }
  leave(leaves, fate.is_delayed);
  if (fate.is_doubled) leave(leaves, fate.is_delayed);
  if (late_) leave(*std::exchange(late_, std::nullopt), false);
}

void StruckFrames::leave(const Frame& frame, bool is_delayed) {
  if (!is_delayed || waiting_ >= kMostWaitingFrames) return put_(frame);
  const std::chrono::duration<double> time{delay_.in(second)};
  auto timer = std::make_shared<boost::asio::steady_timer>(
      io_, std::chrono::duration_cast<std::chrono::steady_clock::duration>(time));
  ++waiting_;
  timer->async_wait([this, timer, frame, alive = is_alive_](boost::system::error_code cancelled) {
    if (!*alive) return;
    --waiting_;
    if (!cancelled) put_(frame);
  });
}

}  // namespace toftwin::daemon
