// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/modbus/server.h"

#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>

#include <algorithm>
#include <array>
#include <chrono>

namespace toftwin::daemon::modbus {
namespace {

using boost::asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kMostConnections = 16;
constexpr std::chrono::seconds kLongSilence{10};  ///< after which a connection's place can be another's

}  // namespace

class Server::Connection : public std::enable_shared_from_this<Connection> {
  using Kind = LineFaults::Kind;

 public:
  Connection(Server& server, tcp::socket socket)
      : server_(server),
        alive_(server.is_alive_),
        socket_(std::move(socket)),
        later_(socket_.get_executor()) {
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
    send(server_.hooks_.fate());
  }
  [[nodiscard]] std::chrono::steady_clock::time_point heard() const { return heard_; }
  void close() {
    error_code ignored;
    socket_.close(ignored);
    later_.cancel();
    if (*alive_) server_.remove(shared_from_this());
  }

 private:
  /// The answer as the line lets it through, and on to the next request.
  void send(const LineFaults::Fate& fate) {
    if (fate.is_cut) return note(fate, Kind::Disconnect), close();
    if (fate.is_lost) return note(fate, Kind::Loss), goOn();
    if (!fate.is_delayed) return write(fate);
    const std::chrono::duration<double> delay{server_.hooks_.delay.in(second)};
    later_.expires_after(std::chrono::duration_cast<std::chrono::steady_clock::duration>(delay));
    later_.async_wait([self = shared_from_this(), fate](error_code cancelled) {
      if (cancelled || !*self->alive_) return;
      self->note(fate, Kind::Delay);
      self->write(fate);
    });
  }
  void write(const LineFaults::Fate& fate) {
    if (fate.is_corrupted) {
      note(fate, Kind::Corruption);
      LineFaults::corrupt(answer_, fate.noise);
    }
    if (fate.is_doubled) {
      note(fate, Kind::Duplicate);
      const Bytes once = answer_;
      answer_.insert(answer_.end(), once.begin(), once.end());
    }
    boost::asio::async_write(socket_, boost::asio::buffer(answer_),
                             [self = shared_from_this()](error_code error, std::size_t) {
                               if (error || !*self->alive_) return self->close();
                               self->goOn();
                             });
  }
  void note(const LineFaults::Fate& fate, Kind kind) { server_.hooks_.note(fate, kind); }
  void read() {
    socket_.async_read_some(
        boost::asio::buffer(piece_), [self = shared_from_this()](error_code error, std::size_t size) {
          if (error || !*self->alive_) return self->close();
          self->heard_ = std::chrono::steady_clock::now();
          const auto begin = self->piece_.begin();
          self->received_.insert(self->received_.end(), begin, begin + static_cast<std::ptrdiff_t>(size));
          self->goOn();
        });
  }

  Server& server_;
  const std::shared_ptr<bool> alive_;
  tcp::socket socket_;
  boost::asio::steady_timer later_;
  std::chrono::steady_clock::time_point heard_ = std::chrono::steady_clock::now();
  std::array<std::byte, 512> piece_{};
  Bytes received_;  ///< less than a message and a piece
  Bytes answer_;
};

Server::Server(Listening listening, Hooks hooks)
    : hooks_(std::move(hooks)),
      accepting_(std::move(listening), [this](tcp::socket socket) { take(std::move(socket)); }) {}

Server::~Server() {
  *is_alive_ = false;
  for (const auto& connection : connections_) connection->close();
}

void Server::take(tcp::socket socket) {
  if (connections_.size() >= kMostConnections) {
    const auto silent = *std::ranges::min_element(connections_, {}, [](const auto& one) { return one->heard(); });
    if (std::chrono::steady_clock::now() - silent->heard() < kLongSilence) return;
    silent->close();
  }
  auto connection = std::make_shared<Connection>(*this, std::move(socket));
  connections_.insert(connection);
  hooks_.connections(connections_.size());
  connection->goOn();
}

void Server::remove(const std::shared_ptr<Connection>& connection) {
  if (connections_.erase(connection) > 0) hooks_.connections(connections_.size());
}

}  // namespace toftwin::daemon::modbus
