// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <toftwin/frame.h>

#include "daemon/frame_queue.h"
#include "daemon/selection.h"

namespace toftwin::daemon {

/// What one subscriber wants of a source.
struct Wish {
  Selection selection;
  FrameQueue::Settings queue;
  bool in_shared_memory = false;  ///< takes bodies that way, where that is worth while
};

/// One subscriber of a source.
struct Subscriber {
  Subscriber(Wish wanted, std::function<void()> wake)
      : wish(std::move(wanted)), queue(wish.queue, std::move(wake)) {}
  const Wish wish;
  FrameQueue queue;
  std::uint64_t number = 0;  ///< in the order in which they came; guarded by the host
  std::optional<std::uint64_t> unacknowledged;  ///< lockstep; guarded by the host
};
/// Shared by the source's host, which fills the queue, and the session or recorder that empties it.
using SubscriberPtr = std::shared_ptr<Subscriber>;

/// Hands a frame to everyone who takes it. It is selected and encoded once per distinct
/// selection.
void fanOut(const Frame& frame, const std::vector<SubscriberPtr>& takers);

}  // namespace toftwin::daemon
