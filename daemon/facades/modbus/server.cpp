// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/modbus/server.h"

#include <boost/asio/write.hpp>

#include <array>

namespace toftwin::daemon::modbus {
namespace {

using boost::asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kMostConnections = 16;

}  // namespace

class Server::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Server& server, tcp::socket socket)
      : server_(server), alive_(server.is_alive_), socket_(std::move(socket)) {
    error_code ignored;
    socket_.set_option(tcp::no_delay{true}, ignored);
    socket_.set_option(boost::asio::socket_base::keep_alive{true}, ignored);
  }
  /// Answers what is there, then reads on.
  void goOn() {
    const std::span<const std::byte> bytes{received_};
    const auto size = messageSize(bytes);
    if (size == std::size_t{0}) return close();
    if (!size || bytes.size() < *size) return read();
    answer_ = server_.hooks_.answer(bytes.first(*size));
    received_.erase(received_.begin(), received_.begin() + static_cast<std::ptrdiff_t>(*size));
    boost::asio::async_write(socket_, boost::asio::buffer(answer_),
                             [self = shared_from_this()](error_code error, std::size_t) {
                               if (error || !*self->alive_) return self->close();
                               self->goOn();
                             });
  }
  void close() {
    error_code ignored;
    socket_.close(ignored);
    if (*alive_) server_.remove(shared_from_this());
  }

 private:
  void read() {
    socket_.async_read_some(
        boost::asio::buffer(piece_), [self = shared_from_this()](error_code error, std::size_t size) {
          if (error || !*self->alive_) return self->close();
          const auto begin = self->piece_.begin();
          self->received_.insert(self->received_.end(), begin, begin + static_cast<std::ptrdiff_t>(size));
          self->goOn();
        });
  }

  Server& server_;
  const std::shared_ptr<bool> alive_;
  tcp::socket socket_;
  std::array<std::byte, 512> piece_{};
  Bytes received_;  ///< less than a message and a piece
  Bytes answer_;
};

Server::Server(tcp::acceptor acceptor, Hooks hooks)
    : hooks_(std::move(hooks)),
      accepting_(std::move(acceptor), [this](tcp::socket socket) { take(std::move(socket)); }) {}

Server::~Server() {
  *is_alive_ = false;
  for (const auto& connection : connections_) connection->close();
}

void Server::take(tcp::socket socket) {
  if (connections_.size() >= kMostConnections) return;
  auto connection = std::make_shared<Connection>(*this, std::move(socket));
  connections_.insert(connection);
  hooks_.connections(connections_.size());
  connection->goOn();
}

void Server::remove(const std::shared_ptr<Connection>& connection) {
  if (connections_.erase(connection) > 0) hooks_.connections(connections_.size());
}

}  // namespace toftwin::daemon::modbus
