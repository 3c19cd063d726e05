// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "protocol/wire/messages.h"

namespace toftwin::client {

/// How many frames a subscription lets the daemon send before it acknowledges one. It bounds the
/// memory that a slow application costs here, and keeps the reading thread free for the others.
std::uint32_t windowOf(wire::Policy policy);

/// Frames of one subscription that arrived, between the reading thread and the application's, which
/// waits here. What was not sent yet waits in the daemon, in its Backlog.
class Inbox {
 public:
  explicit Inbox(wire::Policy policy) : policy_(policy) {}

  /// Under Latest the newer frame replaces the one that waits, so a frame is acknowledged when it
  /// arrives; else when the application takes it.
  [[nodiscard]] bool isAcknowledgedOnArrival() const { return policy_ == wire::Policy::Latest; }

  [[nodiscard]] bool isLockstep() const { return policy_ == wire::Policy::Lockstep; }

  /// Error Overrun if the daemon sends more than the window allows.
  Result<> push(Frame frame);
  /// No more frames; those that wait can still be taken. The first reason counts.
  void end(Error reason);
  /// Waits for a frame, or says Timeout or why there will be none.
  Result<Frame> pop(std::chrono::milliseconds timeout);

 private:
  const wire::Policy policy_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Frame> frames_;
  std::optional<Error> end_;
};

}  // namespace toftwin::client
