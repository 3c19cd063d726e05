// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/usb_camera/server.h"

#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <optional>

#include "daemon/facades/usb_camera/operations.h"
#include "daemon/facades/usb_camera/transfers.h"
#include "daemon/vanished_peer.h"
#include "drivers/logging.h"

namespace toftwin::daemon::usb_camera {
namespace {

using boost::asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kMostHosts = 16, kPieceBytes = 16U << 10U;
constexpr std::chrono::seconds kPatience{10};          // with one that has not imported the device
constexpr std::chrono::milliseconds kShortestWait{1};  // of a timer, so that no device can make it spin

}  // namespace

class Server::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Server& server, tcp::socket socket)
      : server_(server),
        alive_(server.is_alive_),
        socket_(std::move(socket)),
        timer_(socket_.get_executor()) {
    error_code ignored;
    const auto peer = socket_.remote_endpoint(ignored);
    peer_ = fmt::format("{} port {}", peer.address().to_string(ignored), peer.port());
    socket_.set_option(tcp::no_delay{true}, ignored);
    noticeVanishedPeer(socket_.native_handle(), server_.patience_);
  }

  void begin() {
    timer_.expires_after(kPatience);
    timer_.async_wait([self = shared_from_this()](error_code cancelled) {
      if (!cancelled && *self->alive_ && !self->transfers_) self->close();
    });
    goOn();
  }

  /// Does what was received, lets the device do what it can, writes, reads on.
  void goOn() {
    if (is_going_on_) return;  // the device called for it, in the midst of it
    is_going_on_ = true;
    struct End {
      bool& is_going_on;
      ~End() { is_going_on = false; }
    } const end{is_going_on_};
    if (auto done = takeAll(); !done) return close(done.error().message);
    if (transfers_) {
      transfers_->serve(std::chrono::steady_clock::now());
      setTimer();
    }
    write();
    read();
  }

  void close(const std::string& why = {}) {
    if (!socket_.is_open()) return;
    if (!why.empty()) logging::warn("{}: {} is cut off: {}", server_.name_, peer_, why);
    if (transfers_) logging::info("{}: {} has the camera no longer", server_.name_, peer_);
    error_code ignored;
    socket_.shutdown(tcp::socket::shutdown_both, ignored);
    socket_.close(ignored);
    timer_.cancel();
    transfers_.reset();
    if (*alive_) server_.remove(shared_from_this());
  }

 private:
  Result<> takeAll() {
    const std::span<const std::byte> all{received_};
    std::size_t taken = 0;
    while (!isFull() && !is_last_) {
      const auto size = transfers_ ? takeCommand(all.subspan(taken)) : takeOperation(all.subspan(taken));
      if (!size) return size.error();
      if (*size == 0) break;
      taken += *size;
    }
    received_.erase(received_.begin(), received_.begin() + static_cast<std::ptrdiff_t>(taken));
    return {};
  }
  /// How many bytes it had; 0: it is not whole yet.
  Result<std::size_t> takeCommand(std::span<const std::byte> bytes) {
    const auto size = Transfers::sizeOf(bytes);
    if (!size) return size.error();
    if (!*size || bytes.size() < **size) return std::size_t{0};
    if (auto taken = transfers_->take(bytes.first(**size)); !taken) return taken.error();
    return **size;
  }
  Result<std::size_t> takeOperation(std::span<const std::byte> bytes) {
    const auto operation = readOperation(bytes);
    if (!operation) return operation.error();
    if (!*operation) return std::size_t{0};
    const Bytes answer = (*operation)->kind == Operation::Kind::List ? listAnswer(server_.device_)
                                                                     : import((*operation)->bus_id);
    answers_.insert(answers_.end(), answer.begin(), answer.end());
    is_last_ = !transfers_;  // one request each, unless it is told that it has the device
    return (*operation)->size;
  }
  Bytes import(const std::string& bus_id) {
    if (server_.device_ == nullptr || bus_id != kBusId) return importAnswer(ImportStatus::NoDevice, nullptr);
    if (!server_.host_.expired()) return importAnswer(ImportStatus::Busy, nullptr);
    server_.host_ = weak_from_this();
    timer_.cancel();
    transfers_.emplace(*server_.device_);
    server_.device_->onAttach();
    logging::info("{}: {} has the camera", server_.name_, peer_);
    return importAnswer(ImportStatus::Imported, server_.device_);
  }

  [[nodiscard]] bool isFull() const {
    constexpr std::size_t kMostAnswers = 64U << 10U;
    return answers_.size() > kMostAnswers || (transfers_ && transfers_->isFull());
  }

  void setTimer() {
    const SteadyTime due = transfers_->due();
    if (due == SteadyTime::max() || timer_due_ == due) return;
    timer_due_ = due;
    timer_.expires_at(std::max(due, std::chrono::steady_clock::now() + kShortestWait));
    timer_.async_wait([self = shared_from_this()](error_code cancelled) {
      if (cancelled || !*self->alive_ || !self->transfers_) return;
      self->timer_due_.reset();
      self->goOn();
    });
  }

  void write() {
    if (is_writing_ || !socket_.is_open()) return;
    if (transfers_) {
      Bytes output = std::exchange(transfers_->output(), {});
      answers_.insert(answers_.end(), output.begin(), output.end());
    }
    if (answers_.empty()) return;
    writing_ = std::exchange(answers_, {});
    is_writing_ = true;
    boost::asio::async_write(socket_, boost::asio::buffer(writing_),
                             [self = shared_from_this()](error_code error, std::size_t) {
                               self->is_writing_ = false;
                               if (error || !*self->alive_ || self->is_last_) return self->close();
                               self->goOn();
                             });
  }
  /// Not while there is much that the host has not read.
  void read() {
    if (is_reading_ || is_last_ || isFull() || !socket_.is_open()) return;
    is_reading_ = true;
    socket_.async_read_some(
        boost::asio::buffer(piece_), [self = shared_from_this()](error_code error, std::size_t size) {
          self->is_reading_ = false;
          if (error || !*self->alive_) return self->close();
          const auto begin = self->piece_.begin();
          self->received_.insert(self->received_.end(), begin, begin + static_cast<std::ptrdiff_t>(size));
          self->goOn();
        });
  }

  Server& server_;
  const std::shared_ptr<bool> alive_;
  tcp::socket socket_;
  boost::asio::steady_timer timer_;
  std::optional<SteadyTime> timer_due_;  ///< what the timer waits for
  std::string peer_;
  std::array<std::byte, kPieceBytes> piece_{};
  Bytes received_;  ///< at most one command, and a piece
  Bytes answers_, writing_;
  std::optional<Transfers> transfers_;  ///< once it has the device
  bool is_reading_ = false, is_writing_ = false, is_going_on_ = false;
  bool is_last_ = false;  ///< what is being written; then it is closed
};

Server::Server(Listening listening, std::string name, std::chrono::milliseconds patience)
    : name_(std::move(name)),
      patience_(patience),
      accepting_(std::move(listening), [this](tcp::socket socket) { take(std::move(socket)); }) {}

Server::~Server() {
  unplug();
  *is_alive_ = false;
  for (const auto& connection : connections_) connection->close();
}

void Server::unplug() {
  if (const auto host = host_.lock()) host->close();
  device_ = nullptr;
}

void Server::pump() {
  if (const auto host = host_.lock()) host->goOn();
}

void Server::take(tcp::socket socket) {
  if (connections_.size() >= kMostHosts) return;
  auto connection = std::make_shared<Connection>(*this, std::move(socket));
  connections_.insert(connection);
  connection->begin();
}

void Server::remove(const std::shared_ptr<Connection>& connection) {
  connections_.erase(connection);
  if (host_.lock() == connection) host_.reset();
}

}  // namespace toftwin::daemon::usb_camera
