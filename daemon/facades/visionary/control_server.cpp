// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/visionary/control_server.h"

#include <boost/asio/write.hpp>

#include <array>
#include <deque>
#include <span>

namespace toftwin::daemon::visionary {
namespace {

using boost::asio::ip::tcp;
using boost::system::error_code;
using toftwin::visionary::Telegram;

constexpr std::size_t kMostControlConnections = 16, kLongestTelegram = 64 << 10, kMostAnswers = 64;

}  // namespace

/// One client of the port. Its commands are answered one after another.
class ControlServer::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(ControlServer& server, tcp::socket socket, std::uint32_t session)
      : server_(server), alive_(server.is_alive_), socket_(std::move(socket)), session_(session) {
    error_code ignored;
    socket_.set_option(tcp::no_delay{true}, ignored);
    socket_.set_option(boost::asio::socket_base::keep_alive{true}, ignored);
  }

  void read() {
    socket_.async_read_some(boost::asio::buffer(piece_),
                            [self = shared_from_this()](error_code error, std::size_t size) {
                              if (error || !*self->alive_) return self->close();
                              self->reader_.feed(std::span{self->piece_}.first(size));
                              self->obeyNext();
                            });
  }
  void close() {
    error_code ignored;
    socket_.close(ignored);
    if (*alive_) server_.connections_.erase(shared_from_this());
  }

 private:
  /// The next is read when this one is answered.
  void obeyNext() {
    auto telegram = reader_.next();
    if (!telegram) return close();
    if (!*telegram) return read();
    const auto wanted = session_.take(**telegram, std::chrono::steady_clock::now());
    if (const auto* reply = std::get_if<Telegram>(&wanted)) {
      send(*reply);
      return again();
    }
    server_.ask_(std::get<ColaCommand>(wanted), session_.client(),
                 [self = shared_from_this(),
                  asked = Telegram{(*telegram)->session, (*telegram)->request, {}}](Bytes answer) mutable {
                   if (!*self->alive_ || !self->socket_.is_open()) return;
                   asked.command = std::move(answer);
                   self->send(asked);
                   self->again();
                 });
  }
  /// Not from within: a client may have sent thousands of commands at once.
  void again() {
    boost::asio::post(socket_.get_executor(), [self = shared_from_this()] {
      if (*self->alive_ && self->socket_.is_open()) self->obeyNext();
    });
  }
  void send(const Telegram& telegram) {
    if (queue_.size() >= kMostAnswers) return close();
    queue_.push_back(encode(telegram));
    if (queue_.size() == 1) write();
  }
  void write() {
    boost::asio::async_write(socket_, boost::asio::buffer(queue_.front()),
                             [self = shared_from_this()](error_code error, std::size_t) {
                               if (error || !*self->alive_) return self->close();
                               self->queue_.pop_front();
                               if (!self->queue_.empty()) self->write();
                             });
  }

  ControlServer& server_;
  const std::shared_ptr<bool> alive_;
  tcp::socket socket_;
  Session session_;
  toftwin::visionary::TelegramReader reader_{kLongestTelegram};
  std::array<std::byte, 4096> piece_{};
  std::deque<Bytes> queue_;
};

ControlServer::ControlServer(Listening listening, Ask ask)
    : ask_(std::move(ask)),
      accepting_(std::move(listening), [this](tcp::socket socket) { take(std::move(socket)); }) {}

ControlServer::~ControlServer() {
  *is_alive_ = false;
  const auto all = connections_;
  for (const auto& connection : all) connection->close();
}

void ControlServer::take(tcp::socket socket) {
  if (connections_.size() >= kMostControlConnections) return;
  if (next_session_ == 0) next_session_ = 1;
  auto connection = std::make_shared<Connection>(*this, std::move(socket), next_session_++);
  connections_.insert(connection);
  connection->read();
}

}  // namespace toftwin::daemon::visionary
