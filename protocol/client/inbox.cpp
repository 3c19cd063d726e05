// SPDX-License-Identifier: Apache-2.0
#include "protocol/client/inbox.h"

#include <algorithm>
#include <string>
#include <utility>

namespace toftwin::client {

std::uint32_t windowOf(wire::Policy policy) {
  switch (policy) {
    case wire::Policy::Latest:
      return 2;  // one on its way while the other is being taken over
    case wire::Policy::Lockstep:
      return 1;  // by definition
    case wire::Policy::Queue:
    case wire::Policy::Lossless:
      break;
  }
  return 4;
}

/// Wakes when the lock is free again: whoever is woken under it runs into it and sleeps once more, which
/// costs two more turns of the scheduler for each frame of each application.
Result<> Inbox::push(Frame frame) {
  {
    const std::scoped_lock lock{mutex_};
    if (policy_ == wire::Policy::Latest) {
      for (const Frame& missed : frames_) frame.dropped_before += missed.dropped_before + 1;
      frames_.clear();
    } else if (frames_.size() >= windowOf(policy_)) {
      return Error{Error::Code::Overrun, "toftwind sent more frames than the subscription's window of " +
                                             std::to_string(windowOf(policy_)) + " allows"};
    }
    frames_.push_back(std::move(frame));
  }
  changed_.notify_one();
  return {};
}

void Inbox::end(Error reason) {
  const std::scoped_lock lock{mutex_};
  if (!end_) end_ = std::move(reason);
  changed_.notify_all();
}

Result<Frame> Inbox::pop(std::chrono::milliseconds timeout) {
  using std::chrono::steady_clock;
  // A year is as good as for ever, and can be added to a time point without overflow.
  const auto longest = std::chrono::hours{24 * 365};
  const auto deadline =
      steady_clock::now() + std::clamp<std::chrono::milliseconds>(timeout, {}, longest);
  std::unique_lock lock{mutex_};
  changed_.wait_until(lock, deadline, [&] { return !frames_.empty() || end_; });
  if (!frames_.empty()) {
    Frame frame = std::move(frames_.front());
    frames_.pop_front();
    return frame;
  }
  if (end_) return *end_;
  return Error{Error::Code::Timeout,
               "no frame came within " + std::to_string(timeout.count()) + " ms"};
}

}  // namespace toftwin::client
