// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <chrono>
#include <stop_token>

#include "drivers/pace.h"

namespace toftwin::drivers {

/// Asio without a thread of its own: what was begun goes on while the source's one thread waits
/// here, until it is done, a time has come, or the thread is asked to stop.
class EventLoop {
 public:
  enum class End { Done, TooLate, Stopped };

  [[nodiscard]] boost::asio::io_context& io() { return io_; }

  /// Waits until `done()`, which the handlers of what was begun make true.
  template <class Condition>
  End waitUntil(Condition done, SteadyTime deadline, const std::stop_token& stop = {}) {
    const std::stop_callback wake{stop, [this] { boost::asio::post(io_, [] {}); }};
    while (!done()) {
      if (stop.stop_requested()) return End::Stopped;
      if (std::chrono::steady_clock::now() >= deadline) return End::TooLate;
      io_.run_one_until(deadline);
    }
    return End::Done;
  }

 private:
  boost::asio::io_context io_;
  // Without it a loop with nothing to do would come back at once instead of waiting.
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> stay_{
      io_.get_executor()};
};

}  // namespace toftwin::drivers
