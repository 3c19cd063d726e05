// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/buffer.hpp>
#include <boost/asio/generic/stream_protocol.hpp>

#include <openssl/ssl.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "protocol/transport/tls.h"

namespace toftwin::transport {

struct EncryptAside;

/// TLS on a socket. OpenSSL works on memory, and the socket gives and takes a quarter of a megabyte at a time: a system call,
/// and a wake of the peer, for each of TLS's records of 16 KiB took three times as long as encrypting them. All calls come from
/// the socket's executor, whose loop runs until nothing is left to do; one read and one write may be under way. While a server
/// sends to several, what is large is encrypted on threads aside, and what is read waits for the end of that. Handlers keep alive whatever holds this object, live in
/// the operation that is under way and nowhere else, and never run inside the call that they were given to.
class TlsStream {
 public:
  using Socket = boost::asio::generic::stream_protocol::socket;
  using AgreeHandler = std::function<void(Result<>)>;
  using ReadHandler = std::function<void(boost::system::error_code, std::size_t)>;
  using WriteHandler = std::function<void(boost::system::error_code)>;

  /// `aside`: of the context; null: all is done by the caller's thread.
  TlsStream(Socket& socket, std::shared_ptr<const TlsContext> context, SSL_CTX* of, EncryptAside* aside);
  void beServer();
  /// The peer's certificate must be of that host.
  void beClientOf(const std::string& host);
  ~TlsStream();
  TlsStream(const TlsStream&) = delete;
  TlsStream& operator=(const TlsStream&) = delete;

  /// Errors: Disconnected; PermissionDenied, whose message has OpenSSL's reason.
  void asyncAgree(AgreeHandler handler);
  /// At least one byte, and as many as have come and the buffer holds.
  void asyncReadSome(boost::asio::mutable_buffer into, ReadHandler handler);
  /// All of the buffers, whose bytes stay where they are until the handler is called.
  void asyncWrite(std::vector<boost::asio::const_buffer> from, WriteHandler handler);

  /// More than can be read of what has come: what is read beyond it is still to come, and is encrypted no shorter. Not while a
  /// server writes.
  [[nodiscard]] std::size_t atMostBuffered() const;
  [[nodiscard]] SSL* ssl() const { return ssl_.get(); }

  static constexpr std::size_t kPart = 256 << 10;  ///< encrypted, sent and received at once

 private:
  struct Memory;
  struct Job;
  void agreeOn(AgreeHandler handler);
  void afterFlush(int outcome, int reason, AgreeHandler handler);
  template <class Then>
  void receive(Then then);
  template <class Then>
  void send(Then then);
  void sendPart(std::shared_ptr<Job> job);
  void encryptAside(std::shared_ptr<Job> job);
  void sendEncrypted(boost::system::error_code fault, std::shared_ptr<Job> job);
  boost::system::error_code encryptPart(Job& job, std::size_t most);

  Socket& socket_;
  std::shared_ptr<const TlsContext> context_;  // shared with the other connections
  std::unique_ptr<Memory> memory_;
  std::unique_ptr<SSL, void (*)(SSL*)> ssl_;
  EncryptAside* aside_;   ///< of `context_`
  bool is_aside_ = false;             ///< another thread has `ssl_`
  std::function<void()> read_after_;  ///< what is read when it has come back
};

}  // namespace toftwin::transport
