// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/visionary/stream_server.h"

#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>

#include <array>
#include <chrono>
#include <deque>

namespace toftwin::daemon::visionary {
namespace {

using boost::asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kMostStreamConnections = 16;
constexpr std::size_t kMostBlobs = 4;            ///< that wait for a client; more are lost
constexpr std::chrono::seconds kCutPatience{1};  ///< with a client that does not take the half that is left

}  // namespace

class StreamServer::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(StreamServer& server, tcp::socket socket)
      : server_(server), alive_(server.is_alive_), socket_(std::move(socket)), ends_(socket_.get_executor()) {
    error_code ignored;
    socket_.set_option(tcp::no_delay{true}, ignored);
    socket_.set_option(boost::asio::socket_base::keep_alive{true}, ignored);
  }
  void read() {
    socket_.async_read_some(boost::asio::buffer(piece_),
                            [self = shared_from_this()](error_code error, std::size_t) {
                              if (error || !*self->alive_) return self->close();
                              self->read();
                            });
  }
  bool send(const SharedBytes& blob) {
    if (is_ending_ || queue_.size() >= kMostBlobs) return false;
    queue_.push_back(blob);
    if (queue_.size() == 1) write();
    return true;
  }
  bool endWith(const SharedBytes& half) {
    if (is_ending_) return false;
    is_ending_ = true;
    if (queue_.size() > 1) queue_.erase(queue_.begin() + 1, queue_.end());
    queue_.push_back(half);
    if (queue_.size() == 1) write();
    ends_.expires_after(kCutPatience);
    ends_.async_wait([self = shared_from_this()](error_code cancelled) {
      if (!cancelled) self->close();
    });
    return true;
  }
  void close() {
    ends_.cancel();
    error_code ignored;
    socket_.close(ignored);
    if (*alive_) server_.remove(shared_from_this());
  }

 private:
  void write() {
    boost::asio::async_write(socket_, boost::asio::buffer(*queue_.front()),
                             [self = shared_from_this()](error_code error, std::size_t) {
                               if (error || !*self->alive_) return self->close();
                               self->queue_.pop_front();
                               if (!self->queue_.empty()) return self->write();
                               if (self->is_ending_) self->close();
                             });
  }

  StreamServer& server_;
  const std::shared_ptr<bool> alive_;
  tcp::socket socket_;
  boost::asio::steady_timer ends_;
  std::array<std::byte, 256> piece_{};
  std::deque<SharedBytes> queue_;
  bool is_ending_ = false;
};

StreamServer::StreamServer(Listening listening, std::function<void(std::size_t)> connections)
    : count_(std::move(connections)),
      accepting_(std::move(listening), [this](tcp::socket socket) { take(std::move(socket)); }) {}

StreamServer::~StreamServer() {
  *is_alive_ = false;
  const auto all = connections_;
  for (const auto& connection : all) connection->close();
}

void StreamServer::take(tcp::socket socket) {
  if (connections_.size() >= kMostStreamConnections) return;
  auto connection = std::make_shared<Connection>(*this, std::move(socket));
  connections_.insert(connection);
  count_(connections_.size());
  connection->read();
}

void StreamServer::remove(const std::shared_ptr<Connection>& connection) {
  if (connections_.erase(connection) > 0) count_(connections_.size());
}

bool StreamServer::publish(const SharedBytes& blob) {
  const auto all = connections_;  // sending may close one
  bool has_left = false;
  for (const auto& connection : all) has_left |= connection->send(blob);
  return has_left;
}

bool StreamServer::cut(const SharedBytes& half) {
  const auto all = connections_;
  bool has_left = false;
  for (const auto& connection : all) has_left |= connection->endWith(half);
  return has_left;
}

}  // namespace toftwin::daemon::visionary
