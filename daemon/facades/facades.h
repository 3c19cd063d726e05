// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "daemon/config.h"
#include "daemon/facades/facade.h"

namespace toftwin::daemon {

/// The facades of a running daemon. One that cannot start, because its port is in use, say, is told in the
/// log and tried again, one that this build lacks is told; the daemon serves its other clients meanwhile.
/// One with a boot time is started when that is over. Health says of all of them where they are, or why they
/// are not there. Used on the thread of the io_context only.
class Facades {
 public:
  Facades(boost::asio::io_context& io, Hub& hub, const Clock& clock) : hub_(hub), clock_(clock), pause_(io) {}

  /// Makes what runs what is configured. Those that are configured as before run on.
  void apply(std::vector<ConfiguredFacade> configured);
  /// Closes all; may wait for what a facade does at that moment.
  void stop();

 private:
  struct Running {
    ConfiguredFacade configured;
    std::chrono::steady_clock::time_point boots_until{};
    std::unique_ptr<Facade> facade;  ///< null: to be tried again, unless this build lacks it
    std::string last_error;          ///< why it is not there
  };
  void start(Running& one);
  void startThoseThatAreNot();
  void tellHealth();

  Hub& hub_;
  const Clock& clock_;
  boost::asio::steady_timer pause_;
  std::vector<Running> running_;
};

}  // namespace toftwin::daemon
