// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/steady_timer.hpp>

#include <array>
#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <string>

#include "daemon/clock.h"
#include "daemon/peer.h"
#include "daemon/peer_log.h"
#include "daemon/session.h"
#include "protocol/transport/framed_socket.h"

namespace toftwin::daemon {

/// A session on a socket. At most one message is under way in each direction; everything else waits
/// in the session's queues, where its policies hold. Used on the thread of the io_context only.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  struct Options {
    std::size_t subscriptions = 16;
    std::uint32_t request_bytes = 64 * 1024;
    std::chrono::milliseconds handshake{5000};
    /// With a peer over TCP that does not answer, or takes nothing while something is to be sent.
    std::chrono::milliseconds patience{60'000};
    std::chrono::milliseconds lockstep_patience{10'000};  ///< likewise, if a source waits for it
    std::chrono::milliseconds lockstep_wait{10'000};      ///< of others, for it to acknowledge
    std::chrono::milliseconds idle{60'000};               ///< with one that says nothing
  };
  /// What it asks of the server.
  struct Hooks {
    std::function<Result<>()> admit;  ///< at its Hello; else it is told the error and closed
    std::shared_ptr<const Access> access;  ///< shared by all; null: everybody may do all
    std::shared_ptr<PeerLog> log;          ///< likewise
    std::shared_ptr<const transport::TlsContext> tls{};  ///< likewise, of TCP; null: in clear text
    std::function<void()> on_closed;
  };

  Connection(transport::Socket socket, Hub& hub, Options options, std::string name, Hooks hooks);
  void start();
  /// Sends the failure as the last message, after what is owed already, and closes.
  void dismiss(Error why);
  void close() noexcept;
  [[nodiscard]] const Peer& peer() const { return peer_; }
  /// It has said Hello and was let in, and has not been told to go.
  [[nodiscard]] bool isAdmitted() const { return is_admitted_ && !is_last_; }
  /// Since when it has said nothing.
  [[nodiscard]] SteadyTime heard() const { return heard_; }

 private:
  struct UnderWay;

  template <class Work>
  void guarded(Work work) noexcept;
  void begin();
  void read();
  void take(Result<wire::Message> message);
  [[nodiscard]] Session::Options sessionOptions() const;
  Result<> admit(const wire::Message& first);
  void waitWhileIdle();
  void pump();
  void send(const Session::Outgoing& outgoing);
  void sent(const Result<>& result);
  void hangUp();
  void drain();
  void giveUpAfter(std::chrono::milliseconds timeout, std::function<void()> then);
  std::function<void()> waker();

  transport::FramedSocket socket_;
  const Options options_;
  const Peer peer_;
  const std::string name_;
  Hooks hooks_;
  boost::asio::steady_timer timer_;  ///< of the handshake, then of silence, then of the farewell
  SteadyTime heard_ = std::chrono::steady_clock::now();
  std::atomic<bool> is_wake_posted_{false};
  Hub* hub_;
  std::unique_ptr<Session> session_;
  std::deque<wire::Message> answers_;
  std::array<char, 4096> scratch_{};
  std::optional<SteadyTime> frame_made_;  ///< of the frame that is being written
  bool is_admitted_ = false;
  bool is_reading_ = false;
  bool is_writing_ = false;
  bool is_last_ = false;  ///< closes when the answers are sent
  bool is_hung_up_ = false;
  bool is_closed_ = false;
};

}  // namespace toftwin::daemon
