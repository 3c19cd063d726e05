// SPDX-License-Identifier: Apache-2.0
#include "daemon/backlog.h"

#include <fmt/format.h>

#include <utility>

namespace toftwin::daemon {
namespace {

/// Smaller bodies go through the socket faster than through a file descriptor and a mapping.
constexpr std::uint64_t kSmallestSharedBody = 64 * 1024;
/// Of a frame beside its planes: its tables, exposures and allocations, rounded up.
constexpr std::uint64_t kFrameOverhead = 4096;

}  // namespace

std::shared_ptr<const transport::SharedBody> PreparedFrame::sharedBody() const {
  if (body.bytes < kSmallestSharedBody) return nullptr;
  const std::scoped_lock lock{mutex_};
  if (auto shared = shared_.lock()) return shared;
  const auto made = transport::SharedBody::create(body);
  if (!made) return nullptr;
  shared_ = *made;
  return *made;
}

std::uint64_t PreparedFrame::heldBytes() const { return body.bytes + kFrameOverhead; }

Backlog::Backlog(Settings settings, std::function<void()> wake)
    : settings_(settings), wake_(std::move(wake)) {}

bool Backlog::wants(SteadyTime now) {
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

void Backlog::push(PreparedFramePtr frame) {
  {
    const std::scoped_lock lock{mutex_};
    if (end_) return;
    const bool was_empty = frames_.empty();
    if (settings_.policy == wire::Policy::Lossless &&
        bytes_ + frame->heldBytes() > settings_.byte_limit) {
      end_ = Error{
          Error::Code::Overrun,
          fmt::format("{} frames ({} MB) wait for this lossless subscriber, which is the "
                      "daemon's limit (limits.subscription_backlog_mb): read faster, ask for less, "
                      "or raise the limit",
                      frames_.size(), bytes_ >> 20)};
    } else {
      bytes_ += frame->heldBytes();
      frames_.push_back(std::move(frame));
      while (frames_.size() > 1 && isTooMuch()) dropOldest();
    }
    if (!was_empty) return;
  }
  wake_();
}

bool Backlog::isTooMuch() const {
  switch (settings_.policy) {
    case wire::Policy::Lossless:
      return false;  // it has ended with Overrun before
    case wire::Policy::Queue:
      return frames_.size() > settings_.depth || bytes_ > settings_.byte_limit;
    case wire::Policy::Latest:
    case wire::Policy::Lockstep:  // whose source waits for it, so that there is never a second
      break;
  }
  return frames_.size() > 1;
}

void Backlog::dropOldest() {
  bytes_ -= frames_.front()->heldBytes();
  frames_.pop_front();
  ++dropped_;
}

void Backlog::end(Error reason) {
  {
    const std::scoped_lock lock{mutex_};
    if (end_) return;
    end_ = std::move(reason);
    if (!frames_.empty()) return;
  }
  wake_();
}

bool Backlog::hasEnded() const {
  const std::scoped_lock lock{mutex_};
  return end_.has_value();
}

std::uint64_t Backlog::heldBytes() const {
  const std::scoped_lock lock{mutex_};
  return bytes_;
}

std::optional<Backlog::Item> Backlog::take() {
  const std::scoped_lock lock{mutex_};
  if (!frames_.empty()) {
    Delivery delivery{std::move(frames_.front()), std::exchange(dropped_, 0)};
    frames_.pop_front();
    bytes_ -= delivery.frame->heldBytes();
    return delivery;
  }
  if (!end_ || end_taken_) return std::nullopt;
  end_taken_ = true;
  return *end_;
}

}  // namespace toftwin::daemon
