// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/ip/tcp.hpp>

#include <functional>
#include <memory>
#include <set>

#include <toftwin/units.h>

#include "daemon/facades/accepting.h"
#include "daemon/facades/line_faults.h"
#include "daemon/facades/modbus/requests.h"

namespace toftwin::daemon::modbus {

/// Modbus TCP's connections. Each has one request at a time, so that one that stalls or does not read holds
/// up and costs nobody else. Used on the facade's thread only.
class Server {
 public:
  struct Hooks {
    std::function<Bytes(std::span<const std::byte> message)> answer;
    std::function<void(std::size_t)> connections;  ///< how many, whenever that changed
    std::function<LineFaults::Fate()> fate;        ///< of the next answer
    std::function<void(const LineFaults::Fate&, LineFaults::Kind)> note;  ///< it happened
    Duration delay = 100_ms;                       ///< of one that is delayed
  };
  Server(Listening listening, Hooks hooks);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  [[nodiscard]] std::uint16_t port() const { return accepting_.port(); }

 private:
  class Connection;
  void take(boost::asio::ip::tcp::socket socket);
  void remove(const std::shared_ptr<Connection>& connection);

  const Hooks hooks_;
  std::set<std::shared_ptr<Connection>> connections_;  // shared with their handlers
  const std::shared_ptr<bool> is_alive_ = std::make_shared<bool>(true);
  Accepting accepting_;
};

}  // namespace toftwin::daemon::modbus
