// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "daemon/facades/ifm/pcic_shared.h"
#include "drivers/o3d303/wire/pcic.h"

namespace toftwin::daemon::ifm {

/// One client of the port: what it wants, and what waits for it.
class PcicConnection : public std::enable_shared_from_this<PcicConnection> {
  using tcp = boost::asio::ip::tcp;
  using error_code = boost::system::error_code;
  using Bytes = toftwin::o3d303::Bytes;
  using Schema = toftwin::o3d303::Schema;

 public:
  /// Shared by the connections that send them.
  using SharedBytes = std::shared_ptr<const Bytes>;

  PcicConnection(PcicShared& shared, tcp::socket socket, int number)
      : shared_(shared),
        alive_(shared.is_alive),
        number_(number),
        socket_(std::move(socket)),
        ends_(socket_.get_executor()),
        waits_(socket_.get_executor()) {
    error_code ignored;
    socket_.set_option(tcp::no_delay{true}, ignored);
    socket_.set_option(boost::asio::socket_base::keep_alive{true}, ignored);
  }
  /// What it gets a frame by; nothing if it wants none.
  [[nodiscard]] std::optional<Schema> wanted() const {
    if ((output_ & Output::kResults) == 0) return std::nullopt;
    return schema();
  }
  [[nodiscard]] Schema schema() const { return schema_ ? *schema_ : shared_.hooks.default_schema(); }
  [[nodiscard]] bool takes(unsigned output) const { return (output_ & output) != 0; }
  [[nodiscard]] int number() const { return number_; }
  [[nodiscard]] toftwin::o3d303::PcicVersion version() const { return version_; }
  /// Whether the frame was waited for, and is the answer.
  bool answerWith(const FrameWriter& frame) {
    if (!waiting_ticket_) return false;
    const std::string ticket = *std::exchange(waiting_ticket_, std::nullopt);
    waits_.cancel();
    const auto content = frame(withoutMarkers(schema()));
    content ? replyWith(ticket, *content) : reply(ticket, toftwin::o3d303::kRefused);
    return true;
  }

  void read() {
    socket_.async_read_some(boost::asio::buffer(piece_),
                            [self = shared_from_this()](error_code error, std::size_t size) {
                              if (error || !*self->alive_) return self->close();
                              if (self->is_ending_) return self->read();
                              self->reader_.feed(std::span{self->piece_}.first(size));
                              if (self->obeyAll()) self->read();
                            });
  }
  /// False if it takes no more.
  bool send(SharedBytes bytes, bool is_frame) {
    if (is_ending_) return false;
    if (is_frame && frames_waiting_ >= kMostFrames) return false;
    if (queue_.size() >= kMostMessages) return close(), false;
    frames_waiting_ += is_frame ? 1 : 0;
    queue_.push_back({std::move(bytes), is_frame});
    if (queue_.size() == 1) write();
    return true;
  }
  void tellError(int code) { reply(toftwin::o3d303::kErrorTicket, fmt::format("{:09}", code)); }
  /// What is under way, then these bytes, and the connection ends, whether or not the client takes them.
  bool endWith(SharedBytes bytes) {
    if (is_ending_) return false;
    is_ending_ = true;
    if (queue_.size() > 1) queue_.erase(queue_.begin() + 1, queue_.end());
    queue_.push_back({std::move(bytes), false});
    if (queue_.size() == 1) write();
    ends_.expires_after(kCutPatience);
    ends_.async_wait([self = shared_from_this()](error_code cancelled) {
      if (!cancelled) self->close();
    });
    return true;
  }
  void close() {
    ends_.cancel();
    waits_.cancel();
    error_code ignored;
    socket_.close(ignored);
    if (*alive_) shared_.remove(shared_from_this());
  }

 private:
  static constexpr std::size_t kLongestCommand = 128 << 10;
  /// More are lost. Two that the line doubles may leave at once.
  static constexpr std::size_t kMostFrames = 6;
  static constexpr std::size_t kMostMessages = 64;  ///< one that asks and never reads is closed
  /// With a client that does not take the half that is left.
  static constexpr std::chrono::seconds kCutPatience{1};

  struct Waiting {
    SharedBytes bytes;
    bool is_frame;
  };

  /// False if the connection was closed.
  bool obeyAll() {
    while (true) {
      auto message = reader_.next();
      if (!message) return close(), false;
      if (!*message) return true;
      obey(**message);
      if (!socket_.is_open()) return false;
    }
  }
  // pcic_connection.cpp: what the commands do
  void obey(const toftwin::o3d303::PcicMessage& message);
  void trigger(const std::string& ticket);
  /// The frame is the answer, without being sent to this connection once more.
  void triggerAndWait(const std::string& ticket);
  void stopWaiting();
  void replyImage(const std::string& ticket, int number);
  void activate(const std::string& ticket, int index);
  void wire(const std::string& ticket, const Command& command);
  void setVersion(const std::string& ticket, int version);

  void reply(std::string_view ticket, char answer) { reply(ticket, std::string_view{&answer, 1}); }
  void reply(std::string_view ticket, std::string_view answer) {
    if (!socket_.is_open()) return;
    send(std::make_shared<const Bytes>(toftwin::o3d303::encodePcic(ticket, answer, version_)), false);
  }
  void replyWith(std::string_view ticket, const Bytes& answer) {
    reply(ticket, toftwin::o3d303::textOf(answer));
  }
  void write() {
    boost::asio::async_write(socket_, boost::asio::buffer(*queue_.front().bytes),
                             [self = shared_from_this()](error_code error, std::size_t) {
                               if (error || !*self->alive_) return self->close();
                               self->frames_waiting_ -= self->queue_.front().is_frame ? 1 : 0;
                               self->queue_.pop_front();
                               if (!self->queue_.empty()) return self->write();
                               if (self->is_ending_) self->close();
                             });
  }

  PcicShared& shared_;
  const std::shared_ptr<bool> alive_;
  const int number_;
  toftwin::o3d303::PcicVersion version_ = toftwin::o3d303::PcicVersion::V3;
  tcp::socket socket_;
  boost::asio::steady_timer ends_, waits_;
  std::optional<std::string> waiting_ticket_;  ///< of "T?"
  toftwin::o3d303::PcicReader reader_{kLongestCommand};
  std::array<std::byte, 4096> piece_{};
  std::optional<Schema> schema_;
  std::string schema_text_;
  unsigned output_ = Output::kAll;
  std::deque<Waiting> queue_;
  std::size_t frames_waiting_ = 0;
  bool is_ending_ = false;  ///< takes no more, and obeys no more
};

}  // namespace toftwin::daemon::ifm
