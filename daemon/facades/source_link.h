// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/steady_timer.hpp>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "daemon/facades/event_thread.h"
#include "daemon/facades/facade.h"
#include "daemon/facades/held_frames.h"
#include "daemon/hub.h"

namespace toftwin::daemon {

/// What joins a facade to its source, by the source's name: a source that is stopped, lost or configured anew
/// is found again. Frames come when the facade's keys let them: `latency` later, and as unevenly as
/// `intervals`. Everything here is called on the facade's thread, and calls back on it.
class SourceLink {
 public:
  struct Wants {
    std::vector<PlaneKind> planes;  ///< those of them that the source has, whenever it has them
    std::size_t queue = 8;          ///< frames that may wait for the facade
  };
  using TakeFrame = std::function<void(const Frame&)>;
  using Done = std::function<void(Result<>)>;

  SourceLink(EventThread& thread, const FacadePlace& place, Wants wants, TakeFrame take);
  ~SourceLink();
  SourceLink(const SourceLink&) = delete;
  SourceLink& operator=(const SourceLink&) = delete;

  /// Whether frames are wanted; a source on demand makes them only then. Tried again until it works.
  void want(bool is_wanted);
  [[nodiscard]] Result<wire::SourceDescription> describe() const;
  /// Nothing but the name if there is no such source.
  [[nodiscard]] wire::SourceHealth health() const;

  void post(SourceHost::Command command, Done done);
  void trigger(Done done);

 private:
  void subscribe();
  Result<SubscriberPtr> subscribeTo(SourceHost& host);
  void noteRefused(const Error& why);
  void unsubscribe();
  void tryAgain();
  void takeAll();
  void take(const Frame& frame);
  [[nodiscard]] Done onThread(Done done) const;

  Hub& hub_;
  const std::shared_ptr<Account> account_;  // shared with subscriptions, which may outlive this
  const std::string source_;
  const Wants wants_;
  const TakeFrame take_;
  const std::shared_ptr<EventThread::Door> door_;  // shared with what wakes
  boost::asio::steady_timer pause_;
  const Unevenness unevenness_;
  const std::chrono::nanoseconds latency_;
  const Clock& clock_;
  HeldFrames held_;
  std::uint64_t taken_ = 0;
  bool is_wanted_ = false;
  std::shared_ptr<SourceHost> host_;  // shared with the hub, which may let go of it first
  SubscriberPtr subscriber_;
  std::string refused_;  ///< why, as the log has it; empty once there was a subscription
  /// Shared with handlers that are posted and may come when this is gone.
  const std::shared_ptr<bool> is_alive_ = std::make_shared<bool>(true);
};

}  // namespace toftwin::daemon
