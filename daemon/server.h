// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "daemon/connection.h"
#include "daemon/hub.h"
#include "daemon/listen.h"

namespace toftwin::daemon {

/// Accepts clients on a TCP port and a Unix socket. Used on the thread of the io_context only.
class Server {
 public:
  struct Options {
    std::size_t sessions = 64;
    std::size_t sessions_per_peer = 48;   ///< of one user of this machine, or of one other machine
    std::size_t greetings_per_peer = 32;  ///< connections of such a one that have not said Hello
    Connection::Options connection;
    std::shared_ptr<const Access> access{};  ///< shared by the connections
    std::shared_ptr<const transport::TlsContext> tls{};  ///< likewise, of TCP; null: in clear text
  };

  Server(boost::asio::io_context& io, Hub& hub, Options options);
  Result<> listenTcp(const std::string& address, std::uint16_t port);
  Result<> listenUnix(const std::string& path);
  /// Accepts again where something thrown kept it from that.
  void keepAccepting();
  /// For clients that come from now on.
  void setOptions(Options options) { options_ = std::move(options); }

  /// The TCP port that it listens on, 0 if none.
  [[nodiscard]] std::uint16_t port() const;
  /// The path of the Unix socket, empty if none.
  [[nodiscard]] std::string socketPath() const;

  /// Takes no more clients, tells those that there are why, and closes them; `done` when all are
  /// gone.
  void shutDown(const Error& why, std::function<void()> done);

 private:
  /// Beside a listener.
  struct Accepting {
    boost::asio::steady_timer pause;  ///< for when accept(2) fails for want of file descriptors
    /// Accepting or pausing. Shared with the handler, which may go without having been called.
    std::shared_ptr<bool> is_under_way = std::make_shared<bool>(false);
  };
  class UnderWay;

  template <class Acceptor>
  void accept(Acceptor& acceptor, Accepting& accepting);
  void tryToAdopt(transport::Socket socket);
  void adopt(transport::Socket socket);
  void forget(std::uint64_t id);
  Result<> admit(std::uint64_t id);
  void makeRoomForGreeting(const std::string& peer);
  /// Those of that peer, or all.
  [[nodiscard]] std::size_t admitted(const std::optional<std::string>& peer = {}) const;
  /// Lets go of the one of them that has been silent for longest, if it has been for long.
  bool letGoOfSilent(const std::optional<std::string>& peer = {});

  boost::asio::io_context& io_;
  Hub& hub_;
  Options options_;
  std::optional<boost::asio::ip::tcp::acceptor> tcp_;
  std::optional<UnixListener> unix_;
  Accepting tcp_accepting_;
  Accepting unix_accepting_;
  bool is_shut_ = false;
  std::map<std::uint64_t, std::shared_ptr<Connection>> connections_;  // shared with their handlers
  std::uint64_t last_id_ = 0;
  const std::shared_ptr<PeerLog> log_ = std::make_shared<PeerLog>();  // shared by the connections
  std::function<void()> on_empty_;
};

}  // namespace toftwin::daemon
