// SPDX-License-Identifier: Apache-2.0
#include "protocol/transport/framed_socket.h"

#include <sys/socket.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "protocol/transport/tls_context.h"
#include "protocol/transport/tls_stream.h"
#include "protocol/wire/crc32c.h"

namespace toftwin::transport {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr std::size_t kInput = 4096;           // holds preamble and header of a usual frame
constexpr std::size_t kMaxDescriptors = 4;     // that may wait for the message they belong to
constexpr std::size_t kPart = 256 << 10;        // of a body: received and summed while in the CPU's caches
constexpr std::size_t kMaxTransfer = 4 << 20;  // bytes per system call; asio's default is 64 KiB

Error disconnected(const error_code& fault) {
  if (fault == asio::error::eof) {
    return {Error::Code::Disconnected, "the peer closed the connection"};
  }
  return {Error::Code::Disconnected, "the connection broke: " + fault.message()};
}

/// Everything, in pieces as large as the kernel takes.
std::size_t untilDone(const error_code& fault, std::size_t) { return fault ? 0 : kMaxTransfer; }

/// A control message with room for one file descriptor.
union Control {
  char bytes[CMSG_SPACE(sizeof(int))];
  cmsghdr align;
};

}  // namespace

FramedSocket::FramedSocket(Socket socket, wire::Limits limits)
    : socket_(std::move(socket)), limits_(limits), input_(kInput) {}

FramedSocket::~FramedSocket() = default;

void FramedSocket::asyncEncrypt(std::shared_ptr<const TlsContext> context, const std::string& host,
                                WriteHandler handler) {
  const TlsContext::State& of = *context->state_;
  tls_ = std::make_unique<TlsStream>(socket_, context, context->state_->context.native_handle(), of.aside.get());
  if (of.is_server) tls_->beServer();
  if (!of.is_server) tls_->beClientOf(host);
  tls_->asyncAgree(std::move(handler));
}

std::string FramedSocket::certifiedName() const {
  if (!tls_) return {};
  SSL* const ssl = tls_->ssl();
  X509* const certificate = ::SSL_get1_peer_certificate(ssl);
  if (certificate == nullptr) return {};
  std::string name;
  if (::SSL_get_verify_result(ssl) == X509_V_OK) {
    char text[256] = {};
    const int size = ::X509_NAME_get_text_by_NID(::X509_get_subject_name(certificate), NID_commonName, text, sizeof text);
    if (size > 0) name.assign(text, static_cast<std::size_t>(size));
  }
  ::X509_free(certificate);
  return name;
}

template <class Buffers, class Handler>
void FramedSocket::readSome(const Buffers& buffers, Handler handler) {
  if (tls_) {
    auto kept = std::make_shared<Handler>(std::move(handler));  // which may hold what cannot be copied
    return tls_->asyncReadSome(buffers, [kept](error_code fault, std::size_t count) { (*kept)(fault, count); });
  }
  socket_.async_read_some(buffers, std::move(handler));
}

bool FramedSocket::isLocal() const {
  error_code fault;
  return socket_.local_endpoint(fault).protocol().family() == AF_UNIX && !fault;
}

void FramedSocket::close() {
  error_code ignored;  // a connection that is gone already is closed as well; under TLS lengths tell what is whole
  socket_.shutdown(Socket::shutdown_both, ignored);
  socket_.close(ignored);
}

// ---- reading
// ---------------------------------------------------------------------------------------

void FramedSocket::asyncRead(ReadHandler handler) {
  refused_request_ = 0;
  asio::post(socket_.get_executor(), [this, handler = std::move(handler)]() mutable {
    fill(wire::kPreambleSize, &FramedSocket::takePreamble, std::move(handler));
  });
}

/// Goes on with `next` once at least `wanted` bytes are in `input_`.
void FramedSocket::fill(std::size_t wanted, Step next, ReadHandler handler) {
  if (filled_ >= wanted) return (this->*next)(std::move(handler));
  if (input_.size() < wanted) input_.resize(wanted);
  if (accepts_shared_bodies_) return fillWithDescriptors(wanted, next, std::move(handler));
  readSome(asio::buffer(input_) + filled_,
                          [this, wanted, next, handler = std::move(handler)](
                              error_code fault, std::size_t count) mutable {
                            if (fault) return handler(disconnected(fault));
                            filled_ += count;
                            fill(wanted, next, std::move(handler));
                          });
}

void FramedSocket::fillWithDescriptors(std::size_t wanted, Step next, ReadHandler handler) {
  while (filled_ < wanted) {
    const Result<bool> received = receiveWithDescriptors();
    if (!received) return handler(received.error());
    if (*received) continue;
    socket_.async_wait(Socket::wait_read, [this, wanted, next,
                                           handler = std::move(handler)](error_code fault) mutable {
      if (fault) return handler(disconnected(fault));
      fillWithDescriptors(wanted, next, std::move(handler));
    });
    return;
  }
  (this->*next)(std::move(handler));
}

/// One recvmsg(2) that takes file descriptors along; false if nothing is there yet.
Result<bool> FramedSocket::receiveWithDescriptors() {
  iovec room{input_.data() + filled_, input_.size() - filled_};
  Control control{};
  msghdr message{};
  message.msg_iov = &room;
  message.msg_iovlen = 1;
  message.msg_control = control.bytes;
  message.msg_controllen =
      CMSG_LEN(sizeof(int));  // not CMSG_SPACE: its padding would hold a second
  const ssize_t count =
      ::recvmsg(socket_.native_handle(), &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
  if (count < 0) {
    if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) return false;
    return disconnected(error_code{errno, boost::system::system_category()});
  }
  for (cmsghdr* item = CMSG_FIRSTHDR(&message); item; item = CMSG_NXTHDR(&message, item)) {
    if (item->cmsg_level != SOL_SOCKET || item->cmsg_type != SCM_RIGHTS) continue;
    int fd = -1;
    std::memcpy(&fd, CMSG_DATA(item), sizeof fd);
    descriptors_.emplace_back(fd);
  }
  if (count == 0) return disconnected(asio::error::eof);
  if (message.msg_flags & MSG_CTRUNC) {
    return Error{Error::Code::Malformed,
                 "file descriptors were lost: the peer sends more than one with a message, or this "
                 "process has too many files open (ulimit -n)"};
  }
  if (descriptors_.size() > kMaxDescriptors) {
    return Error{Error::Code::Malformed,
                 "the peer sends file descriptors that no message refers to"};
  }
  filled_ += static_cast<std::size_t>(count);
  return true;
}

void FramedSocket::takePreamble(ReadHandler handler) {
  const auto bytes = std::span{input_}.first<wire::kPreambleSize>();
  const auto preamble = wire::decodePreamble(bytes, limits_);
  if (!preamble) return handler(preamble.error());
  if (preamble->body_place == wire::BodyPlace::Memfd && !accepts_shared_bodies_) {
    return handler(Error{Error::Code::Malformed,
                         "the peer put a body into shared memory, which was not agreed on"});
  }
  preamble_ = *preamble;
  fill(wire::kPreambleSize + preamble_.header_bytes, &FramedSocket::takeBody, std::move(handler));
}

void FramedSocket::takeBody(ReadHandler handler) {
  if (preamble_.body_place == wire::BodyPlace::Memfd) {
    if (descriptors_.empty()) {
      return handler(Error{Error::Code::Malformed, "the body's file descriptor is missing"});
    }
    const FileDescriptor memfd = std::move(descriptors_.front());
    descriptors_.pop_front();
    auto body = mapSharedBody(memfd, preamble_.body_bytes);
    if (!body) return handler(body.error());
    return finish(std::move(*body), preamble_.body_crc32c, handler);  // sealed: nothing to check
  }
  takeInlineBody(std::move(handler));
}

void FramedSocket::takeInlineBody(ReadHandler handler) {
  Arriving arriving;
  const std::size_t head = wire::kPreambleSize + preamble_.header_bytes;
  if (preamble_.body_bytes > 0) {
    arriving.body = pool_.allocate(preamble_.body_bytes);
    const std::size_t here = std::min<std::size_t>(filled_ - head, arriving.body.size);
    const auto came_with_header = std::as_bytes(std::span{input_}).subspan(head, here);
    std::ranges::copy(came_with_header, arriving.body.bytes.get());
    arriving.crc32c = wire::crc32c(came_with_header);
    arriving.filled = here;
    std::memmove(input_.data() + head, input_.data() + head + here, filled_ - head - here);
    filled_ -= here;
  }
  takeRest(std::move(arriving), std::move(handler));
}

/// Reads in parts that the CPU's caches hold, so that the checksum finds each where the kernel put
/// it.
void FramedSocket::takeRest(Arriving arriving, ReadHandler handler) {
  const std::size_t left = arriving.body.size - arriving.filled;
  wakeWith(std::clamp<std::size_t>(left, 1, kPart));
  if (left == 0) return finish(arriving.body.buffer(), arriving.crc32c, handler);
  std::byte* const part = arriving.body.bytes.get() + arriving.filled;
  const auto room = asio::buffer(part, std::min(left, kPart));
  readSome(
      room, [this, part, arriving = std::move(arriving), handler = std::move(handler)](
                error_code fault, std::size_t count) mutable {
        if (fault) return handler(disconnected(fault));
        arriving.crc32c = wire::crc32c({part, count}, arriving.crc32c);
        arriving.filled += count;
        takeRest(std::move(arriving), std::move(handler));
      });
}

/// Has the kernel wake this thread when so many bytes are there, not at each segment: a sender on the same
/// machine spends as much time with waking its receivers as with copying. At the stream's end, and when
/// the receive window is full, it wakes in any case.
void FramedSocket::wakeWith(std::size_t bytes) {
  // Encrypted, at least as many are still to come as are wanted beyond those that are here.
  if (tls_ && bytes > 1) bytes = std::max<std::size_t>(bytes, tls_->atMostBuffered() + 1) - tls_->atMostBuffered();
  if (bytes == wakes_with_) return;
  wakes_with_ = bytes;
  error_code ignored;
  socket_.set_option(asio::socket_base::receive_low_watermark{static_cast<int>(bytes)}, ignored);
}

void FramedSocket::finish(Buffer body, std::uint32_t body_crc32c, const ReadHandler& handler) {
  const std::size_t head = wire::kPreambleSize + preamble_.header_bytes;
  const auto header =
      std::as_bytes(std::span{input_}).subspan(wire::kPreambleSize, preamble_.header_bytes);
  auto message = wire::decode(preamble_, header, std::move(body), body_crc32c);
  if (!message) refused_request_ = wire::requestIdOf(header);
  std::memmove(input_.data(), input_.data() + head, filled_ - head);
  filled_ -= head;
  handler(std::move(message));
}

// ---- writing
// ---------------------------------------------------------------------------------------

void FramedSocket::asyncWrite(wire::Encoded message, WriteHandler handler) {
  output_ = std::move(message);
  writeRest(0, std::move(handler));
}

void FramedSocket::asyncWrite(wire::Encoded message, std::shared_ptr<const SharedBody> body,
                              WriteHandler handler) {
  output_ = std::move(message);
  output_body_ = std::move(body);
  wire::setBodyPlace(output_, wire::BodyPlace::Memfd);
  sendDescriptor(std::move(handler));
}

/// The head with the file descriptor beside its first byte, at once. What the kernel does not take follows as plain
/// bytes. The handler is called later in any case.
void FramedSocket::sendDescriptor(WriteHandler handler) {
  iovec bytes{output_.head.data(), output_.head.size()};
  Control control{};
  msghdr message{};
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  message.msg_control = control.bytes;
  message.msg_controllen = sizeof control.bytes;
  cmsghdr* const item = CMSG_FIRSTHDR(&message);
  item->cmsg_level = SOL_SOCKET;
  item->cmsg_type = SCM_RIGHTS;
  item->cmsg_len = CMSG_LEN(sizeof(int));
  const int fd = output_body_->fd();
  std::memcpy(CMSG_DATA(item), &fd, sizeof fd);
  const ssize_t count = ::sendmsg(socket_.native_handle(), &message, MSG_DONTWAIT | MSG_NOSIGNAL);
  if (count >= 0) return writeRest(static_cast<std::size_t>(count), std::move(handler));
  if (errno == ETOOMANYREFS) {  // more descriptors on their way than this user may have files open
    output_body_ = {};
    wire::setBodyPlace(output_, wire::BodyPlace::Inline);
    return writeRest(0, std::move(handler));
  }
  if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) {
    const error_code fault{errno, boost::system::system_category()};
    return asio::post(socket_.get_executor(), [this, fault, handler = std::move(handler)] {
      wrote(disconnected(fault), handler);
    });
  }
  socket_.async_wait(Socket::wait_write,
                     [this, handler = std::move(handler)](error_code fault) mutable {
                       if (fault) return wrote(disconnected(fault), handler);
                       sendDescriptor(std::move(handler));
                     });
}

void FramedSocket::writeRest(std::size_t head_sent, WriteHandler handler) {
  std::vector<asio::const_buffer> buffers;
  buffers.reserve(1 + output_.body.pieces.size());
  buffers.push_back(asio::buffer(output_.head) + head_sent);
  if (!output_body_) {
    for (const Buffer& piece : output_.body.pieces) {
      buffers.emplace_back(piece.bytes().data(), piece.size());
    }
  }
  const auto done = [this, handler = std::move(handler)](error_code fault, std::size_t) {
    wrote(fault ? Result<>{disconnected(fault)} : Result<>{}, handler);
  };
  if (tls_) return tls_->asyncWrite(std::move(buffers), [done](error_code fault) { done(fault, 0); });
  asio::async_write(socket_, buffers, untilDone, done);
}

void FramedSocket::wrote(Result<> result, const WriteHandler& handler) {
  output_ = {};
  output_body_ = {};
  handler(std::move(result));
}

void setNoDelay(Socket& socket) {
  error_code ignored;
  socket.set_option(asio::ip::tcp::no_delay{true}, ignored);
}

}  // namespace toftwin::transport
