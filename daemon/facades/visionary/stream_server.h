// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/ip/tcp.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <set>

#include "daemon/facades/accepting.h"
#include "drivers/visionary/wire/big_endian.h"

namespace toftwin::daemon::visionary {

/// The port on which blobs leave, to all who are connected; one that is slow loses frames, one that stalls
/// holds up nobody. What clients send there is passed over. Used on the facade's thread.
class StreamServer {
 public:
  using SharedBytes = std::shared_ptr<const toftwin::visionary::Bytes>;  // by the connections that send them

  /// `connections` is told how many there are, whenever that changed.
  StreamServer(Listening listening, std::function<void(std::size_t)> connections);
  ~StreamServer();
  StreamServer(const StreamServer&) = delete;
  StreamServer& operator=(const StreamServer&) = delete;
  [[nodiscard]] std::uint16_t port() const { return accepting_.port(); }

  /// Whether it went to any.
  bool publish(const SharedBytes& blob);
  /// Half of it leaves, and the connections end with that.
  bool cut(const SharedBytes& half);

 private:
  class Connection;
  void take(boost::asio::ip::tcp::socket socket);
  void remove(const std::shared_ptr<Connection>& connection);

  const std::function<void(std::size_t)> count_;
  std::set<std::shared_ptr<Connection>> connections_;  // shared with their handlers
  const std::shared_ptr<bool> is_alive_ = std::make_shared<bool>(true);
  Accepting accepting_;
};

}  // namespace toftwin::daemon::visionary
