// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>

#include <toftwin/frame.h>

#include "daemon/clock.h"

namespace toftwin::daemon {

/// Frames that wait for the time at which a real camera's would leave. They leave in order; what comes when
/// so much waits is lost, and the log says so once. Used on the thread of the io_context.
class HeldFrames {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::uint64_t kMostBytes = 512ULL << 20U;
  using Put = std::function<void(const Frame&)>;
  /// When the daemon had it: how long it has been on its way to this thread is no part of a camera's time.
  /// Now, if the frame says that it is more than a second old (the host's clock was set, or it does not
  /// tell), or of the future.
  static Time arrivalOf(const Frame& frame, const Clock& clock);
  /// `name` of who holds them, for the log.
  HeldFrames(boost::asio::io_context& io, std::string name, Put put)
      : name_(std::move(name)), put_(std::move(put)), timer_(io) {}
  void hold(const Frame& frame, Time leaves);
  /// Those that wait are nobody's any more.
  void clear();

 private:
  void wait();
  void noteLost();
  struct Held {
    Time leaves;
    Frame frame;
  };
  const std::string name_;
  const Put put_;
  boost::asio::steady_timer timer_;
  std::deque<Held> held_;
  std::uint64_t bytes_ = 0, lost_ = 0;
};

}  // namespace toftwin::daemon
