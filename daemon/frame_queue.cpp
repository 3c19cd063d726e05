// SPDX-License-Identifier: Apache-2.0
#include "daemon/frame_queue.h"

#include <fmt/format.h>

#include <utility>

namespace toftwin::daemon {

FrameQueue::FrameQueue(Settings settings, std::function<void()> wake)
    : settings_(settings), wake_(std::move(wake)) {}

bool FrameQueue::wants(SteadyTime now) {
  const std::scoped_lock lock{mutex_};
  if (end_) return false;
  if (settings_.max_rate_hz <= 0.0) return true;
  // Frames are due at a fixed rate, so that the mean is kept however the source's frames lie
  // between. A tenth of the period of grace keeps a source with a multiple of the rate and some
  // jitter from missing its turn by a hair and losing a whole interval.
  using std::chrono::duration_cast;
  const auto period = duration_cast<SteadyTime::duration>(
      std::chrono::duration<double>{1.0 / settings_.max_rate_hz});
  if (due_ && now + period / 10 < *due_) return false;
  due_ = (due_ && now < *due_ + period) ? *due_ + period : now + period;
  return true;
}

void FrameQueue::push(PreparedFramePtr frame) {
  {
    const std::scoped_lock lock{mutex_};
    if (end_) return;
    const bool was_empty = frames_.empty();
    if (settings_.policy == wire::Policy::Lossless &&
        bytes_ + frame->body.bytes > settings_.byte_limit) {
      end_ = Error{
          Error::Code::Overrun,
          fmt::format("{} frames ({} MB) wait for this lossless subscriber, which is the "
                      "daemon's limit (limits.lossless_mb): read faster, ask for less, or raise "
                      "the limit",
                      frames_.size(), bytes_ >> 20)};
    } else {
      bytes_ += frame->body.bytes;
      frames_.push_back(std::move(frame));
      if (settings_.policy == wire::Policy::Latest && frames_.size() > 1) dropOldest();
      if (settings_.policy == wire::Policy::Queue && frames_.size() > settings_.depth) dropOldest();
    }
    if (!was_empty) return;
  }
  wake_();
}

void FrameQueue::dropOldest() {
  bytes_ -= frames_.front()->body.bytes;
  frames_.pop_front();
  ++dropped_;
}

void FrameQueue::end(Error reason) {
  {
    const std::scoped_lock lock{mutex_};
    if (end_) return;
    end_ = std::move(reason);
    if (!frames_.empty()) return;
  }
  wake_();
}

bool FrameQueue::hasEnded() const {
  const std::scoped_lock lock{mutex_};
  return end_.has_value();
}

std::optional<FrameQueue::Item> FrameQueue::take() {
  const std::scoped_lock lock{mutex_};
  if (!frames_.empty()) {
    Delivery delivery{std::move(frames_.front()), std::exchange(dropped_, 0)};
    frames_.pop_front();
    bytes_ -= delivery.frame->body.bytes;
    return delivery;
  }
  if (!end_ || end_taken_) return std::nullopt;
  end_taken_ = true;
  return *end_;
}

}  // namespace toftwin::daemon
