// SPDX-License-Identifier: Apache-2.0
#include "daemon/server.h"

#include <boost/asio/post.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "daemon/thrown.h"
#include "drivers/logging.h"

namespace toftwin::daemon {
namespace {

namespace asio = boost::asio;
constexpr std::chrono::milliseconds kAcceptPause{100};
constexpr std::size_t kMostGreetings = 256;  ///< connections that have said no Hello, or were told to go

}  // namespace

Server::Server(asio::io_context& io, Hub& hub, Options options)
    : io_(io),
      hub_(hub),
      options_(std::move(options)),
      tcp_accepting_{asio::steady_timer{io}},
      unix_accepting_{asio::steady_timer{io}} {}

Result<> Server::listenTcp(const std::string& address, std::uint16_t port) {
  auto acceptor = daemon::listenTcp(io_, address, port);
  if (!acceptor) return acceptor.error();
  tcp_.emplace(*std::move(acceptor));
  accept(*tcp_, tcp_accepting_);
  return {};
}

Result<> Server::listenUnix(const std::string& path) {
  auto listener = UnixListener::open(io_, path);
  if (!listener) return listener.error();
  unix_.emplace(*std::move(listener));
  accept(unix_->acceptor(), unix_accepting_);
  return {};
}

std::uint16_t Server::port() const {
  boost::system::error_code ignored;
  return tcp_ ? tcp_->local_endpoint(ignored).port() : std::uint16_t{0};
}

std::string Server::socketPath() const { return unix_ ? unix_->path().string() : std::string{}; }

void Server::keepAccepting() {
  if (is_shut_) return;
  if (tcp_ && !*tcp_accepting_.is_under_way) accept(*tcp_, tcp_accepting_);
  if (unix_ && !*unix_accepting_.is_under_way) accept(unix_->acceptor(), unix_accepting_);
}

/// In a handler: while it waits to be called, its listener is under way.
class Server::UnderWay {
 public:
  explicit UnderWay(const Accepting& of) : flag_(of.is_under_way) { *flag_ = true; }
  UnderWay(UnderWay&&) noexcept = default;
  UnderWay& operator=(UnderWay&&) = delete;
  ~UnderWay() { end(); }
  void end() {
    if (flag_) *std::exchange(flag_, nullptr) = false;
  }

 private:
  std::shared_ptr<bool> flag_;
};

template <class Acceptor>
void Server::accept(Acceptor& acceptor, Accepting& accepting) {
  acceptor.async_accept([this, &acceptor, &accepting, under_way = UnderWay{accepting}](
                            boost::system::error_code fault, auto socket) mutable {
    under_way.end();
    // This may have been queued before the acceptor went.
    if (is_shut_ || fault == asio::error::operation_aborted) return;
    if (fault) {
      logging::warn("cannot accept a client: {}; trying again", fault.message());
      accepting.pause.expires_after(kAcceptPause);
      accepting.pause.async_wait([this, &acceptor, &accepting, pausing = UnderWay{accepting}](
                                     boost::system::error_code stopped) mutable {
        pausing.end();
        if (!is_shut_ && !stopped) accept(acceptor, accepting);
      });
      return;
    }
    tryToAdopt(transport::Socket{std::move(socket)});
    accept(acceptor, accepting);
  });
}

/// A client that there is no memory for is closed.
void Server::tryToAdopt(transport::Socket socket) {
  try {
    adopt(std::move(socket));
  } catch (...) {
    logThrown("a new client");
    if (const auto half = connections_.find(last_id_); half != connections_.end()) half->second->close();
  }
}

void Server::adopt(transport::Socket socket) {
  const std::uint64_t id = ++last_id_;
  auto connection = std::make_shared<Connection>(
      std::move(socket), hub_, options_.connection, fmt::format("client {}", id),
      Connection::Hooks{.admit = [this, id] { return admit(id); },
                        .access = options_.access,
                        .log = log_,
                        .tls = options_.tls,
                        .on_closed = [this, id] { forget(id); }});
  makeRoomForGreeting(connection->peer().name());
  connections_.emplace(id, connection);
  connection->start();
  logging::debug("client {}: connected, {}", id, connection->peer().name());
}

/// Whoever has said no Hello costs a place among those of the same peer only: the oldest goes.
void Server::makeRoomForGreeting(const std::string& peer) {
  std::size_t waiting = 0, of_peer = 0;
  std::shared_ptr<Connection> oldest, oldest_of_peer;
  for (const auto& [id, one] : connections_) {  // in the order in which they came
    if (one->isAdmitted()) continue;
    if (waiting++ == 0) oldest = one;
    if (one->peer().name() == peer && of_peer++ == 0) oldest_of_peer = one;
  }
  if (of_peer >= options_.greetings_per_peer) return oldest_of_peer->close();
  if (waiting >= kMostGreetings) oldest->close();
}

std::size_t Server::admitted(const std::optional<std::string>& peer) const {
  return static_cast<std::size_t>(std::ranges::count_if(connections_, [&](const auto& one) {
    return one.second->isAdmitted() && (!peer || one.second->peer().name() == *peer);
  }));
}

bool Server::letGoOfSilent(const std::optional<std::string>& peer) {
  std::shared_ptr<Connection> silent;
  for (const auto& [id, one] : connections_) {
    if (!one->isAdmitted() || (peer && one->peer().name() != *peer)) continue;
    if (!silent || one->heard() < silent->heard()) silent = one;
  }
  if (!silent || std::chrono::steady_clock::now() - silent->heard() < options_.connection.idle) return false;
  silent->dismiss({Error::Code::Timeout, "another client needs the place, and this one has been silent for longest"});
  return true;
}

/// Of a client that has said Hello: whether there is a place for it.
Result<> Server::admit(std::uint64_t id) {
  const std::string peer = connections_.at(id)->peer().name();
  const auto busy = [&](const std::string& who, std::size_t limit, const char* key) {
    log_->warn(peer, "client {}: turned away, {} = {} is reached by {}", id, key, limit, who);
    return Error{Error::Code::Busy, fmt::format("this daemon has {} clients of {} already, the most that {} allows: "
                                                "close one, or raise the limit",
                                                limit, who, key)};
  };
  if (admitted(peer) >= options_.sessions_per_peer && !letGoOfSilent(peer))
    return busy(peer, options_.sessions_per_peer, "limits.sessions_per_peer");
  if (admitted() >= options_.sessions && !letGoOfSilent()) return busy("all", options_.sessions, "limits.sessions");
  return {};
}

void Server::forget(std::uint64_t id) {
  logging::debug("client {}: gone", id);
  connections_.erase(id);
  if (connections_.empty() && on_empty_) std::exchange(on_empty_, nullptr)();
}

void Server::shutDown(const Error& why, std::function<void()> done) {
  is_shut_ = true;
  tcp_accepting_.pause.cancel();
  unix_accepting_.pause.cancel();
  boost::system::error_code ignored;
  if (tcp_) tcp_->close(ignored);
  if (unix_) unix_->acceptor().close(ignored);
  unix_.reset();
  on_empty_ = std::move(done);
  if (connections_.empty()) return asio::post(io_, std::exchange(on_empty_, nullptr));
  std::vector<std::shared_ptr<Connection>> all;
  for (const auto& [id, connection] : connections_) all.push_back(connection);
  for (const auto& connection : all) connection->dismiss(why);
}

}  // namespace toftwin::daemon
