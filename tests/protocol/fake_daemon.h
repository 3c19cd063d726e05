// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "protocol/transport/framed_socket.h"

namespace toftwin {

/// The other end of a client under test: one thread, real sockets, and a script that says what
/// comes back for each message. The script runs in the daemon's thread.
class FakeDaemon {
 public:
  class Session : public std::enable_shared_from_this<Session> {
   public:
    Session(transport::Socket socket, FakeDaemon& daemon);
    /// Sends after whatever was sent before.
    void send(const wire::Message& message);
    void sendShared(const wire::FrameMessage& message);
    void sendBytes(std::vector<std::byte> bytes);
    void close() { socket_.close(); }

   private:
    friend class FakeDaemon;
    struct Output {
      wire::Encoded message;
      std::shared_ptr<const transport::SharedBody> body;
    };
    void read();
    void write(Output output);
    void writeNext();
    transport::FramedSocket socket_;
    FakeDaemon& daemon_;
    std::deque<Output> output_;
    bool writing_ = false;
  };
  using Script = std::function<void(Session&, const wire::Message&)>;

  /// Listens on a Unix socket in a new temporary folder, or on a free TCP port of loopback.
  enum class On { Unix, Tcp };
  FakeDaemon(On where, Script script);
  ~FakeDaemon();

  /// For Client::connect.
  [[nodiscard]] const std::string& address() const { return address_; }
  /// Runs `work` in the daemon's thread, for every session, and waits until it is done.
  void forEachSession(const std::function<void(Session&)>& work);

  /// The usual: answers Hello, and Subscribe with subscription 7; everything else goes to `more`.
  static Script polite(Script more = [](Session&, const wire::Message&) {});

 private:
  void accept();
  boost::asio::io_context io_;
  std::string folder_, address_;
  std::function<void(std::function<void(transport::Socket)>)> accept_next_;
  Script script_;
  std::vector<std::shared_ptr<Session>> sessions_;
  std::thread thread_;
};

}  // namespace toftwin
