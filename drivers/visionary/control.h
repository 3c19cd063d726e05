// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/ip/tcp.hpp>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>

#include <toftwin/result.h>

#include "drivers/event_loop.h"
#include "drivers/visionary/wire/cola2.h"

namespace toftwin::drivers::visionary {

using Endpoint = boost::asio::ip::tcp::endpoint;
using toftwin::visionary::Bytes;

/// How long a camera in the same network may take to accept a connection, and to answer.
inline constexpr std::chrono::milliseconds kConnectTime{300}, kAnswerTime{2000};

/// A TCP connection whose waits end in time. Errors are Disconnected, with the address, or Stopped.
class Line {
 public:
  explicit Line(EventLoop& loop) : loop_(loop), socket_(loop.io()) {}
  ~Line() { close(); }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  Result<> connect(const Endpoint& to);
  void close();
  [[nodiscard]] bool isOpen() const { return socket_.is_open(); }
  Result<> send(const Bytes& bytes);
  /// What has come; Timeout at the deadline, and nothing is lost by that.
  Result<std::span<const std::byte>> receive(SteadyTime deadline, const std::stop_token& stop);

 private:
  [[nodiscard]] Error lost(std::string_view what) const;

  EventLoop& loop_;
  boost::asio::ip::tcp::socket socket_;
  std::string name_;
  std::array<std::byte, 65'536> piece_;
  bool is_reading_ = false;
  std::size_t size_ = 0;  ///< of what was read and not yet given
  std::optional<boost::system::error_code> failure_;
};

/// The camera's variables and methods, each command in one session.
class Control {
 public:
  Control(EventLoop& loop, Endpoint camera) : line_(loop), camera_(std::move(camera)) {}

  /// Opens a session anew if there is none. Errors: those of the line; NotFound, PermissionDenied,
  /// InvalidArgument as the camera refuses.
  Result<Bytes> read(const std::string& variable);
  Result<> write(const std::string& variable, const Bytes& value);
  Result<Bytes> call(const std::string& method, const Bytes& params = {});
  /// As AuthorizedClient. PermissionDenied: wrong password.
  Result<> logIn(std::string_view password);
  void close() { line_.close(); }

 private:
  Result<Bytes> ask(const toftwin::visionary::ColaCommand& command);
  Result<> open();
  Result<toftwin::visionary::Telegram> exchange(const Bytes& command);

  Line line_;
  const Endpoint camera_;
  toftwin::visionary::TelegramReader reader_{1 << 20};
  std::uint32_t session_ = 0;
  std::uint16_t request_ = 0;
};

}  // namespace toftwin::drivers::visionary
