// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/ip/tcp.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <set>

#include "daemon/facades/accepting.h"
#include "daemon/facades/visionary/session.h"

namespace toftwin::daemon::visionary {

/// The port on which the camera is set, in CoLa 2. A client that stalls holds up nobody. Used on the facade's
/// thread.
class ControlServer {
 public:
  using Answer = std::function<void(Bytes)>;
  /// Called with a command and who asks; the answer may be given later.
  using Ask = std::function<void(const ColaCommand&, Device::Client&, Answer)>;

  ControlServer(Listening listening, Ask ask);
  ~ControlServer();
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;
  [[nodiscard]] std::uint16_t port() const { return accepting_.port(); }

 private:
  class Connection;
  void take(boost::asio::ip::tcp::socket socket);

  const Ask ask_;
  std::uint32_t next_session_ = 1;
  std::set<std::shared_ptr<Connection>> connections_;  // shared with their handlers
  const std::shared_ptr<bool> is_alive_ = std::make_shared<bool>(true);
  Accepting accepting_;
};

}  // namespace toftwin::daemon::visionary
