// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <toftwin/frame.h>

#include "daemon/backlog.h"
#include "daemon/selection.h"

namespace toftwin::daemon {

/// What one subscriber wants of a source.
struct Wish {
  Selection selection;
  Backlog::Settings backlog;
};

/// One subscriber of a source.
struct Subscriber {
  Subscriber(Wish wanted, std::function<void()> wake)
      : wish(std::move(wanted)), backlog(wish.backlog, std::move(wake)) {}
  const Wish wish;
  Backlog backlog;
  std::uint64_t frame_bytes = 0;  ///< of a frame's planes, as far as it was known; set once
  Share reserved;                 ///< of the budget; set once
  std::uint64_t number = 0;  ///< in the order in which they came; guarded by the host
  std::optional<std::uint64_t> unacknowledged;  ///< lockstep; guarded by the host
};
/// Shared by the source's host, which fills the backlog, and the session or recorder that empties it.
using SubscriberPtr = std::shared_ptr<Subscriber>;

/// Ends the subscription; if it cannot be woken to learn it, it finds out when it looks.
void end(Subscriber& subscriber, const Error& reason) noexcept;

/// Hands a frame to everyone who takes it. It is selected and encoded once per distinct
/// selection.
void fanOut(const Frame& frame, const std::vector<SubscriberPtr>& takers);

}  // namespace toftwin::daemon
