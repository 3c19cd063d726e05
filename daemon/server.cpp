// SPDX-License-Identifier: Apache-2.0
#include "daemon/server.h"

#include <boost/asio/post.hpp>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <vector>

namespace toftwin::daemon {
namespace {

namespace asio = boost::asio;
constexpr std::chrono::milliseconds kPause{100};

}  // namespace

Server::Server(asio::io_context& io, Hub& hub, Options options)
    : io_(io), hub_(hub), options_(options), tcp_pause_(io), unix_pause_(io) {}

Result<> Server::listenTcp(const std::string& address, std::uint16_t port) {
  auto acceptor = daemon::listenTcp(io_, address, port);
  if (!acceptor) return acceptor.error();
  tcp_.emplace(*std::move(acceptor));
  accept(*tcp_, tcp_pause_);
  return {};
}

Result<> Server::listenUnix(const std::string& path) {
  auto listener = UnixListener::open(io_, path);
  if (!listener) return listener.error();
  unix_.emplace(*std::move(listener));
  accept(unix_->acceptor(), unix_pause_);
  return {};
}

std::uint16_t Server::port() const {
  boost::system::error_code ignored;
  return tcp_ ? tcp_->local_endpoint(ignored).port() : std::uint16_t{0};
}

std::string Server::socketPath() const { return unix_ ? unix_->path().string() : std::string{}; }

template <class Acceptor>
void Server::accept(Acceptor& acceptor, asio::steady_timer& pause) {
  acceptor.async_accept([this, &acceptor, &pause](boost::system::error_code fault, auto socket) {
    // This may have been queued before the acceptor went.
    if (is_shut_ || fault == asio::error::operation_aborted) return;
    if (fault) {
      spdlog::warn("cannot accept a client: {}; trying again", fault.message());
      pause.expires_after(kPause);
      pause.async_wait([this, &acceptor, &pause](boost::system::error_code stopped) {
        if (!is_shut_ && !stopped) accept(acceptor, pause);
      });
      return;
    }
    adopt(transport::Socket{std::move(socket)});
    accept(acceptor, pause);
  });
}

void Server::adopt(transport::Socket socket) {
  const std::uint64_t id = ++last_id_;
  const bool is_full = connections_.size() >= options_.sessions;
  auto connection =
      std::make_shared<Connection>(std::move(socket), hub_, options_.connection,
                                   fmt::format("client {}", id), [this, id] { forget(id); });
  connections_.emplace(id, connection);
  connection->start();
  if (!is_full) return spdlog::debug("client {}: connected", id);
  spdlog::warn("client {}: turned away, limits.sessions = {} is reached", id, options_.sessions);
  connection->dismiss(
      {Error::Code::Busy,
       fmt::format("this daemon has {} clients already, the most that limits.sessions "
                   "allows: close one, or raise the limit",
                   options_.sessions)});
}

void Server::forget(std::uint64_t id) {
  spdlog::debug("client {}: gone", id);
  connections_.erase(id);
  if (connections_.empty() && on_empty_) std::exchange(on_empty_, nullptr)();
}

void Server::shutDown(const Error& why, std::function<void()> done) {
  is_shut_ = true;
  tcp_pause_.cancel();
  unix_pause_.cancel();
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
