// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/generic/stream_protocol.hpp>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "protocol/transport/buffer_pool.h"
#include "protocol/transport/memfd.h"
#include "protocol/transport/tls.h"
#include "protocol/wire/codec.h"

namespace toftwin::transport {

class TlsStream;

/// A connected TCP or Unix socket; both convert to it.
using Socket = boost::asio::generic::stream_protocol::socket;

/// Sends and receives whole messages on a stream socket; used by daemon and client. All calls come
/// from the socket's executor (one thread or one strand), which also runs the handlers. One read and
/// one write may be under way at a time. A handler must keep alive whatever holds this object;
/// handlers never run inside the call that they were given to.
class FramedSocket {
 public:
  using ReadHandler = std::function<void(Result<wire::Message>)>;
  using WriteHandler = std::function<void(Result<>)>;

  /// What a peer announces is checked against `limits` before anything is allocated.
  explicit FramedSocket(Socket socket, wire::Limits limits = {});
  ~FramedSocket();
  FramedSocket(FramedSocket&&) = delete;
  FramedSocket& operator=(FramedSocket&&) = delete;

  /// Before anything is read or written: agrees on keys with the peer, and looks at its certificate. A client names the
  /// `host` that the daemon's must be of. Error PermissionDenied: whoever it is, is not trusted.
  void asyncEncrypt(std::shared_ptr<const TlsContext> context, const std::string& host, WriteHandler handler);
  /// The common name in the peer's certificate, which was checked; empty if it showed none.
  [[nodiscard]] std::string certifiedName() const;

  /// Waits for the next message. Errors: Disconnected (the peer closed or the connection broke);
  /// Unsupported (a message of unknown kind was skipped: answer `refusedRequest` and read on); all
  /// others leave the stream unusable: send a Failure and close.
  void asyncRead(ReadHandler handler);
  /// The id of the request that the last read refused, 0 if it could not be told.
  [[nodiscard]] std::uint64_t refusedRequest() const { return refused_request_; }

  /// Sends a message; its planes are not copied and stay alive until the handler is called.
  void asyncWrite(wire::Encoded message, WriteHandler handler);
  /// Sends a message whose body the peer finds in shared memory. Only on a Unix socket whose peer
  /// named the feature.
  void asyncWrite(wire::Encoded message, std::shared_ptr<const SharedBody> body, WriteHandler handler);

  /// Whether bodies may come in shared memory: from when this side's Hello named the feature.
  void acceptSharedBodies() { accepts_shared_bodies_ = true; }
  /// Whether it is a Unix socket, so that file descriptors can be passed.
  [[nodiscard]] bool isLocal() const;
  [[nodiscard]] bool isOpen() const { return socket_.is_open(); }
  /// Ends both directions; the handlers under way get Disconnected.
  void close();
  Socket& socket() { return socket_; }

 private:
  // Reading goes through these steps; each hands the handler on, so that it lives in the operation
  // that is under way and nowhere else.
  using Step = void (FramedSocket::*)(ReadHandler);
  void fill(std::size_t wanted, Step next, ReadHandler handler);
  void fillWithDescriptors(std::size_t wanted, Step next, ReadHandler handler);
  Result<bool> receiveWithDescriptors();
  void takePreamble(ReadHandler handler);
  void takeBody(ReadHandler handler);
  /// What of a body has arrived, and its checksum so far.
  struct Arriving {
    wire::AlignedBytes body;
    std::size_t filled = 0;
    std::uint32_t crc32c = 0;
  };
  void takeInlineBody(ReadHandler handler);
  void takeRest(Arriving arriving, ReadHandler handler);
  void wakeWith(std::size_t bytes);
  void finish(Buffer body, std::uint32_t body_crc32c, const ReadHandler& handler);

  void sendDescriptor(WriteHandler handler);
  void writeRest(std::size_t head_sent, WriteHandler handler);
  template <class Buffers, class Handler>
  void readSome(const Buffers& buffers, Handler handler);
  void wrote(Result<> result, const WriteHandler& handler);

  Socket socket_;
  std::unique_ptr<TlsStream> tls_;  ///< null: in clear text. Refers to the socket
  wire::Limits limits_;
  bool accepts_shared_bodies_ = false;

  std::vector<std::byte> input_;  ///< received, not yet used; a message starts at its beginning
  std::size_t filled_ = 0;
  wire::Preamble preamble_;
  std::deque<FileDescriptor> descriptors_;  ///< in the order in which they came
  BufferPool pool_;
  std::uint64_t refused_request_ = 0;
  std::size_t wakes_with_ = 1;  ///< the socket's low watermark

  wire::Encoded output_;
  std::shared_ptr<const SharedBody> output_body_;  // shared with the other subscribers' writes
};

/// Low latency for small messages. Quietly does nothing on a Unix socket.
void setNoDelay(Socket& socket);

}  // namespace toftwin::transport
