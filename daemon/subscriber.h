// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <toftwin/frame.h>

#include "daemon/backlog.h"
#include "daemon/clock.h"
#include "daemon/selection.h"

namespace toftwin::daemon {

/// Who a subscriber is. One without a payer is somebody else than every other.
struct Subscribing {
  std::string name{};  ///< of the user or machine, equal for all its clients
  std::string text{};  ///< for people
  /// How long a lockstep subscriber may keep a source from those of others.
  std::chrono::nanoseconds lockstep_patience{std::chrono::seconds{10}};
};

/// What one subscriber wants of a source.
struct Wish {
  Selection selection;
  Backlog::Settings backlog;
  Subscribing who{};
};

/// One subscriber of a source.
struct Subscriber {
  Subscriber(Wish wanted, std::function<void()> wake)
      : wish(std::move(wanted)), backlog(wish.backlog, std::move(wake)) {}
  const Wish wish;
  Backlog backlog;
  std::uint64_t frame_bytes = 0;  ///< of a frame's planes, as far as it was known; set once
  Share reserved;                 ///< of its payer's account; set once
  std::uint64_t number = 0;  ///< in the order in which they came; guarded by the host
  // Of a lockstep subscriber; guarded by the host.
  std::optional<std::uint64_t> unacknowledged;
  SteadyTime handed_out{};          ///< when it was given that frame
  bool is_passed_over = false;      ///< others did not wait for it any more
  std::uint64_t missed = 0;         ///< frames, meanwhile
  std::uint64_t first_of_its_own = 0;  ///< the number of the first frame begun after it acknowledged
};
/// Shared by the source's host, which fills the backlog, and the session or recorder that empties it.
using SubscriberPtr = std::shared_ptr<Subscriber>;

/// Ends the subscription; if it cannot be woken to learn it, it finds out when it looks.
void end(Subscriber& subscriber, const Error& reason) noexcept;

/// Hands a frame to everyone who takes it. It is selected and encoded once per distinct
/// selection.
void fanOut(const Frame& frame, const std::vector<SubscriberPtr>& takers);

}  // namespace toftwin::daemon
