// SPDX-License-Identifier: Apache-2.0
#include "daemon/server.h"

#include <boost/asio/post.hpp>

#include <fmt/format.h>

#include <utility>
#include <vector>

#include "daemon/thrown.h"
#include "drivers/logging.h"

namespace toftwin::daemon {
namespace {

namespace asio = boost::asio;
constexpr std::chrono::milliseconds kAcceptPause{100};

}  // namespace

Server::Server(asio::io_context& io, Hub& hub, Options options)
    : io_(io),
      hub_(hub),
      options_(options),
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
  const bool is_full = connections_.size() >= options_.sessions;
  auto connection =
      std::make_shared<Connection>(std::move(socket), hub_, options_.connection,
                                   fmt::format("client {}", id), [this, id] { forget(id); });
  connections_.emplace(id, connection);
  connection->start();
  if (!is_full) return logging::debug("client {}: connected", id);
  logging::warn("client {}: turned away, limits.sessions = {} is reached", id, options_.sessions);
  connection->dismiss(
      {Error::Code::Busy,
       fmt::format("this daemon has {} clients already, the most that limits.sessions "
                   "allows: close one, or raise the limit",
                   options_.sessions)});
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
