// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include <toftwin/client.h>

#include "protocol/client/inbox.h"
#include "protocol/transport/address.h"
#include "protocol/transport/framed_socket.h"

namespace toftwin::client {

/// A connection to a daemon with one thread that reads, writes and hands messages out. Its public
/// functions may be called from any other thread.
///
/// The thread never waits for an application: every subscription has a window (windowOf), so the
/// daemon sends no more frames than its queue here holds, and a slow subscription delays neither
/// answers nor other subscriptions.
class Connection {
 public:
  /// Connects and exchanges Hellos.
  static Result<std::shared_ptr<Connection>> open(const transport::Address& address,
                                                  const ClientOptions& options);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Sends a request and waits for its answer, which must be an `Answer`.
  template <class Answer, class Request>
  Result<Answer> ask(Request request) {
    const std::uint64_t id = next_id_++;
    request.id = id;
    Result<wire::Message> answer = exchange(id, std::move(request));
    if (!answer) return answer.error();
    if (auto* failure = std::get_if<wire::Failure>(&*answer)) return std::move(failure->error);
    if (auto* expected = std::get_if<Answer>(&*answer)) return std::move(*expected);
    return unexpectedAnswer();
  }

  struct Subscribed {
    std::uint64_t id = 0;
    std::shared_ptr<Inbox> frames;  // shared with the reading thread
  };
  Result<Subscribed> subscribe(wire::Subscribe request);
  void unsubscribe(std::uint64_t subscription);
  void acknowledge(std::uint64_t subscription, std::uint64_t sequence);

  /// What the daemon calls itself.
  [[nodiscard]] const std::string& software() const { return software_; }
  /// Unsupported if the daemon speaks a version of the protocol that does not know one of these kinds.
  [[nodiscard]] Result<> checkKnown(const std::vector<PlaneKind>& planes) const;
  /// Whether the daemon takes texts for parameters.
  [[nodiscard]] Result<> checkKnowsTexts() const;
  /// Ends the connection; whoever waits gets an error.
  void stop();

 private:
  Connection(transport::Address address, const ClientOptions& options)
      : address_(std::move(address)), options_(options) {}

  using Answered = std::promise<Result<wire::Message>>;
  [[nodiscard]] Error unexpectedAnswer() const;
  Result<> encrypt();
  Result<> greet();
  Result<wire::Message> exchange(std::uint64_t id, wire::Message request);
  void send(wire::Message message);

  // The rest runs in the thread (in the caller's until it is started).
  void enqueue(wire::Encoded message);
  void writeNext();
  void readOn();
  void keepAlive();
  void take(wire::Message message);
  void takeFrame(wire::FrameMessage message);
  void takeAnswer(std::uint64_t id, wire::Message answer);
  void fail(const Error& reason);

  const transport::Address address_;
  const ClientOptions options_;
  std::string software_;
  std::uint16_t minor_ = 0;  ///< of the daemon's version of the protocol
  std::optional<Duration> idle_;  ///< silence after which the daemon lets this client go
  std::atomic<std::uint64_t> next_id_{1};

  boost::asio::io_context io_;
  std::optional<transport::FramedSocket> socket_;
  boost::asio::steady_timer keep_alive_{io_};
  std::deque<wire::Encoded> output_;
  bool writing_ = false;
  std::optional<Error> fault_;
  std::map<std::uint64_t, std::shared_ptr<Answered>> waiting_;  // shared with the waiting caller
  std::map<std::uint64_t, std::shared_ptr<Inbox>> starting_;  ///< by request id
  std::map<std::uint64_t, std::shared_ptr<Inbox>> running_;   ///< by subscription id
  std::thread thread_;
};

}  // namespace toftwin::client
