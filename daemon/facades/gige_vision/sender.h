// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <toftwin/units.h>

#include "daemon/facades/gige_vision/gvsp.h"
#include "daemon/facades/gige_vision/struck_line.h"
#include "daemon/facades/line_faults.h"

namespace toftwin::daemon::gige_vision {

/// How long after one packet of a block the next one leaves: `delay` or, where that is more, as long as
/// spreads the block evenly over half the time between two blocks or 10 ms, whichever is less. So long a
/// client has to read before its socket is full, yet there is far less silence than the 20 ms after which
/// libaravis asks for all that has not come.
std::chrono::nanoseconds pauseBetween(std::uint32_t packets, std::chrono::nanoseconds delay,
                                      std::chrono::nanoseconds between_blocks);
/// How many packets of that size take a third of what a client's socket has room for, by Linux' default 208
/// kB with the kernel's own bytes: 30 of 1500 bytes, 4 of 9000.
int packetsAtOnce(std::uint32_t packet_size);

/// The time between two blocks, of the last ones: their median, for on a busy machine some come late and the
/// next right behind them.
class BlockInterval {
 public:
  void note(std::chrono::steady_clock::time_point block);
  [[nodiscard]] std::chrono::nanoseconds median() const;  ///< long, where only one came yet

 private:
  std::optional<std::chrono::steady_clock::time_point> last_;
  std::deque<std::chrono::nanoseconds> intervals_;
};

/// Sends blocks packet by packet at an even pace, and those that were lost once more. Blocks that come
/// together are spread as if each came in its time: sent as they come, they would be more than a client's
/// socket has room for. A delay of 0: at once, but for packets that are asked for again, for a socket that
/// was full is not filled again. Where it begins, or comes late, it sends no more than packetsAtOnce without
/// a pause. Used on the facade's thread only.
class Sender {
 public:
  using Endpoint = boost::asio::ip::udp::endpoint;
  /// A socket that packets come from; those that `faults` delays leave `late` later.
  Sender(boost::asio::io_context& io, boost::asio::ip::udp::socket socket, LineFaults faults, Duration late,
         std::size_t bytes_kept, std::string name);
  ~Sender() { *is_alive_ = false; }
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;

  void aim(const Endpoint& to, std::uint32_t packet_size, std::chrono::nanoseconds delay);
  /// False where too many blocks wait already; this one is lost then.
  bool send(std::shared_ptr<const Block> block);
  void sendAgain(const Resend& asked);
  void sendTestPacket(std::uint32_t size);
  /// Nothing after the block that is under way, packets of which can still be asked for.
  void finish();
  /// Forgets all that waits and all that was sent.
  void clear();

 private:
  /// Packets of a block that wait.
  struct Waiting {
    std::shared_ptr<const Block> block;  // shared with those that are kept
    std::uint32_t next = 0, last = 0;
    bool is_again = false;
  };
  void pump();
  void wake(std::chrono::steady_clock::time_point when);
  [[nodiscard]] std::chrono::nanoseconds pause() const;
  /// False if the socket takes no more now.
  bool sendNext();
  bool put(const Bytes& packet);

  boost::asio::ip::udp::socket socket_;
  boost::asio::steady_timer timer_;
  StruckLine line_;
  const std::size_t bytes_kept_;
  const std::string name_;
  Endpoint to_;
  std::chrono::nanoseconds delay_{};
  int at_once_ = 1;
  std::chrono::steady_clock::time_point due_{};
  BlockInterval interval_;
  std::deque<Waiting> waiting_, again_;
  std::deque<std::shared_ptr<const Block>> sent_;
  std::size_t sent_bytes_ = 0;
  bool is_pumping_ = false, is_too_large_told_ = false;
  /// Shared with handlers that may come when this is gone.
  const std::shared_ptr<bool> is_alive_ = std::make_shared<bool>(true);
};

}  // namespace toftwin::daemon::gige_vision
