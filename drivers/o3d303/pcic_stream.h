// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <deque>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>

#include <toftwin/result.h>

#include "drivers/event_loop.h"
#include "drivers/o3d303/rpc.h"
#include "drivers/o3d303/wire/pcic.h"
#include "drivers/o3d303/wire/schema.h"

namespace toftwin::drivers::o3d303 {

/// One PCIC connection to the camera.
class PcicStream {
 public:
  struct Message {
    toftwin::o3d303::PcicMessage message;
    SteadyTime arrived;  ///< when its first bytes were read
  };

  /// `driver` names it in errors; it must outlast this.
  explicit PcicStream(EventLoop& loop, std::string_view driver = "o3d303")
      : loop_(loop), driver_(driver), socket_(loop.io()) {}
  ~PcicStream() { close(); }
  PcicStream(const PcicStream&) = delete;
  PcicStream& operator=(const PcicStream&) = delete;

  /// Connects and asks for frames of that schema.
  Result<> open(const Endpoint& camera, const toftwin::o3d303::Schema& schema);
  void close();
  [[nodiscard]] bool isOpen() const { return socket_.is_open(); }

  /// Sends a command and waits for the answer's first character; what else comes is kept.
  Result<char> command(std::string_view command);
  /// The next message that is not an answer. Errors: Timeout at the deadline, Stopped,
  /// Disconnected. A wait that ends early loses nothing.
  Result<Message> next(SteadyTime deadline, const std::stop_token& stop);

 private:
  Result<Message> receive(SteadyTime deadline, const std::stop_token& stop);
  void beginRead();
  [[nodiscard]] Error lost(std::string_view what) const;

  EventLoop& loop_;
  std::string_view driver_;
  boost::asio::ip::tcp::socket socket_;
  std::string name_;
  toftwin::o3d303::PcicReader reader_{kLongestMessage};
  std::deque<Message> kept_;
  bool is_reading_ = false;
  std::optional<boost::system::error_code> failure_;
  SteadyTime read_at_{};  ///< the last piece
  SteadyTime arrived_{};  ///< the piece with the first bytes of the message that comes next
  int next_ticket_ = 1000;
  std::array<std::byte, 65'536> piece_;

  // Eleven images of the largest chunk type would be 3.6 MB.
  static constexpr std::size_t kLongestMessage = 8 << 20;
};

}  // namespace toftwin::drivers::o3d303
