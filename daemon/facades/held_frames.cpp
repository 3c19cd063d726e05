// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/held_frames.h"

#include <fmt/format.h>

#include <algorithm>

#include "drivers/logging.h"

namespace toftwin::daemon {
namespace {

/// Of a frame, with what it has beside its planes, rounded up. Planes may share memory with other
/// subscribers, and are counted as if they did not.
std::uint64_t bytesOf(const Frame& frame) {
  std::uint64_t bytes = 4096;
  for (const Plane& plane : frame.planes) bytes += plane.data.size();
  return bytes;
}

}  // namespace

HeldFrames::Time HeldFrames::arrivalOf(const Frame& frame, const Clock& clock) {
  constexpr std::chrono::nanoseconds kOldest = std::chrono::seconds{1};
  const Time now = std::chrono::steady_clock::now();  // by which they leave
  const std::chrono::nanoseconds age{clock.wall().ns - frame.moment.received.ns};
  return age > std::chrono::nanoseconds{0} && age <= kOldest ? now - age : now;
}

void HeldFrames::hold(const Frame& frame, Time leaves) {
  const std::uint64_t bytes = bytesOf(frame);
  if (!held_.empty() && bytes_ + bytes > kMostBytes) return noteLost();
  if (!held_.empty()) leaves = std::max(leaves, held_.back().leaves);
  held_.push_back({leaves, frame});
  bytes_ += bytes;
  if (held_.size() == 1) wait();
}

void HeldFrames::clear() {
  timer_.cancel();
  held_.clear();
  bytes_ = 0;
}

void HeldFrames::wait() {
  timer_.expires_at(held_.front().leaves);
  timer_.async_wait([this](boost::system::error_code cancelled) {
    // One that was on its way when all were cleared comes too early for those that were held since.
    if (cancelled || held_.empty() || held_.front().leaves > std::chrono::steady_clock::now()) return;
    const Held next = std::move(held_.front());
    held_.pop_front();
    bytes_ -= bytesOf(next.frame);
    if (!held_.empty()) wait();
    put_(next.frame);
  });
}

void HeldFrames::noteLost() {
  if (lost_++ > 0) return;
  logging::warn(
      "{}: {} MB of frames wait for their time, and those that come meanwhile are lost; make latency_ms less",
      name_, kMostBytes >> 20U);
}

}  // namespace toftwin::daemon
