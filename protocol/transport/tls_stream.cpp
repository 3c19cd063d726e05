// SPDX-License-Identifier: Apache-2.0
#include "protocol/transport/tls_stream.h"

#include <arpa/inet.h>

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/x509v3.h>

#include <boost/asio/error.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/write.hpp>

#include <algorithm>
#include <array>
#include <cstring>

#include "protocol/transport/tls_context.h"

namespace toftwin::transport {

namespace asio = boost::asio;
using boost::system::error_code;

namespace {

constexpr std::size_t kRecord = 17 << 10;  // the longest there is, with what is beside its bytes

}  // namespace

/// What OpenSSL reads from and writes to in place of a socket.
struct TlsStream::Memory {
  std::vector<std::byte> in = std::vector<std::byte>(kRecord);  // peers that only ask need no more
  std::size_t taken = 0, filled = 0;  ///< of `in`
  std::vector<std::byte> out;

  [[nodiscard]] std::size_t waiting() const { return filled - taken; }

  /// Room for what comes: what waits moves to the beginning.
  asio::mutable_buffer room() {
    std::memmove(in.data(), in.data() + taken, waiting());
    filled -= std::exchange(taken, 0);
    return asio::buffer(in) + filled;
  }

  int read(char* into, int wanted) {
    const auto count = std::min(waiting(), static_cast<std::size_t>(wanted));
    std::memcpy(into, in.data() + taken, count);
    taken += count;
    return static_cast<int>(count);
  }

  /// Nothing is thrown through OpenSSL: -1 where there is no memory.
  int write(const char* from, int count) noexcept {
    try {
      const auto* bytes = reinterpret_cast<const std::byte*>(from);
      out.insert(out.end(), bytes, bytes + count);
      return count;
    } catch (...) {
      return -1;
    }
  }
};

/// A message that is being sent, by part after part.
struct TlsStream::Job {
  explicit Job(EncryptAside* of) : aside(of) {
    if (aside != nullptr) ++aside->sending;
  }
  ~Job() {
    if (aside != nullptr) --aside->sending;
  }
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  EncryptAside* const aside;
  std::vector<asio::const_buffer> from;
  std::size_t piece = 0, at = 0;  ///< what is to be encrypted next
  std::size_t left = 0;           ///< bytes
  WriteHandler handler;
};

namespace {

/// An end of a stream as OpenSSL sees it; `Memory` is its data.
template <class Memory>
const BIO_METHOD* methodOf() {
  static const BIO_METHOD* const kMethod = [] {
    BIO_METHOD* const method = ::BIO_meth_new(::BIO_get_new_index() | BIO_TYPE_SOURCE_SINK, "toftwin memory");
    ::BIO_meth_set_read(method, [](BIO* bio, char* into, int wanted) {
      ::BIO_clear_retry_flags(bio);
      const int count = static_cast<Memory*>(::BIO_get_data(bio))->read(into, wanted);
      if (count > 0) return count;
      BIO_set_retry_read(bio);
      return -1;
    });
    ::BIO_meth_set_write(method, [](BIO* bio, const char* from, int count) {
      ::BIO_clear_retry_flags(bio);
      return static_cast<Memory*>(::BIO_get_data(bio))->write(from, count);
    });
    ::BIO_meth_set_ctrl(method, [](BIO*, int command, long, void*) -> long { return command == BIO_CTRL_FLUSH ? 1 : 0; });
    return method;
  }();
  return kMethod;
}

bool isIpAddress(const std::string& host) {
  std::array<unsigned char, sizeof(in6_addr)> ignored{};
  return ::inet_pton(AF_INET, host.c_str(), ignored.data()) == 1 || ::inet_pton(AF_INET6, host.c_str(), ignored.data()) == 1;
}

/// The newest of OpenSSL's errors; without one it was this file's memory that was at its end.
error_code lastFault() {
  const auto number = ::ERR_peek_last_error();
  ::ERR_clear_error();
  if (number == 0) return asio::error::no_memory;
  return {static_cast<int>(number), asio::error::get_ssl_category()};
}

/// What an unsuccessful SSL_read met.
error_code faultOf(int reason) {
  if (reason == SSL_ERROR_ZERO_RETURN || reason == SSL_ERROR_SYSCALL) return asio::error::eof;
  return lastFault();
}

}  // namespace

TlsStream::TlsStream(Socket& socket, std::shared_ptr<const TlsContext> context, SSL_CTX* of, EncryptAside* aside)
    : socket_(socket),
      context_(std::move(context)),
      memory_(std::make_unique<Memory>()),
      ssl_(::SSL_new(of), ::SSL_free),
      aside_(aside) {
  BIO* const bio = ssl_ ? ::BIO_new(methodOf<Memory>()) : nullptr;
  if (bio == nullptr) throw std::bad_alloc{};
  ::BIO_set_data(bio, memory_.get());
  ::BIO_set_init(bio, 1);
  ::SSL_set_bio(ssl_.get(), bio, bio);  // which owns it from here on
}

void TlsStream::beServer() { ::SSL_set_accept_state(ssl_.get()); }

void TlsStream::beClientOf(const std::string& host) {
  ::SSL_set_connect_state(ssl_.get());
  const bool is_set = isIpAddress(host) ? ::X509_VERIFY_PARAM_set1_ip_asc(::SSL_get0_param(ssl_.get()), host.c_str()) == 1
                                        : ::SSL_set1_host(ssl_.get(), host.c_str()) == 1;
  if (!is_set) throw std::bad_alloc{};
}

TlsStream::~TlsStream() = default;

std::size_t TlsStream::atMostBuffered() const {
  return memory_->waiting() + static_cast<std::size_t>(std::max(0, ::SSL_pending(ssl_.get())));
}

/// Gets more bytes from the socket.
template <class Then>
void TlsStream::receive(Then then) {
  socket_.async_read_some(memory_->room(), [this, then = std::move(then)](error_code fault, std::size_t count) mutable {
    memory_->filled += count;
    then(fault);
  });
}

/// Gives the socket what OpenSSL wrote.
template <class Then>
void TlsStream::send(Then then) {
  auto bytes = std::make_shared<std::vector<std::byte>>(std::exchange(memory_->out, {}));
  const auto buffer = asio::buffer(*bytes);
  const auto all = [](const error_code& fault, std::size_t) { return fault ? 0 : 4 * kPart; };
  asio::async_write(socket_, buffer, all, [this, bytes, then = std::move(then)](error_code fault, std::size_t) mutable {
    // The next part has its memory, unless something came to be sent meanwhile. Little is kept for nothing.
    bytes->clear();
    if (memory_->out.empty() && bytes->capacity() <= 2 * kPart) memory_->out = std::move(*bytes);
    then(fault);
  });
}

// ---- agreeing on keys
// -------------------------------------------------------------------------------

void TlsStream::asyncAgree(AgreeHandler handler) {
  asio::post(socket_.get_executor(), [this, handler = std::move(handler)]() mutable { agreeOn(std::move(handler)); });
}

void TlsStream::agreeOn(AgreeHandler handler) {
  ::ERR_clear_error();
  const int outcome = ::SSL_do_handshake(ssl_.get());
  const int reason = ::SSL_get_error(ssl_.get(), outcome);
  if (memory_->out.empty()) return afterFlush(outcome, reason, std::move(handler));
  const error_code why = reason == SSL_ERROR_SSL ? lastFault() : error_code{};
  send([this, outcome, reason, why, handler = std::move(handler)](error_code fault) mutable {
    if (why) return handler(Error{Error::Code::PermissionDenied, "TLS could not be agreed on: " + why.message()});
    if (fault) return handler(Error{Error::Code::Disconnected, "TLS could not be agreed on: " + fault.message()});
    afterFlush(outcome, reason, std::move(handler));
  });
}

void TlsStream::afterFlush(int outcome, int reason, AgreeHandler handler) {
  if (outcome == 1) return handler({});
  if (reason != SSL_ERROR_WANT_READ) {
    return handler(Error{Error::Code::PermissionDenied, "TLS could not be agreed on: " + faultOf(reason).message()});
  }
  receive([this, handler = std::move(handler)](error_code fault) mutable {
    if (fault) return handler(Error{Error::Code::Disconnected, "TLS could not be agreed on: " + fault.message()});
    agreeOn(std::move(handler));
  });
}

// ---- reading
// -------------------------------------------------------------------------------

void TlsStream::asyncReadSome(asio::mutable_buffer into, ReadHandler handler) {
  if (is_aside_) {
    read_after_ = [this, into, handler = std::move(handler)] { asyncReadSome(into, handler); };
    return;
  }
  ::ERR_clear_error();
  if (into.size() > memory_->in.size()) memory_->in.resize(std::max(memory_->in.size(), std::min(into.size() + kRecord, kPart)));
  std::size_t count = 0;
  int reason = SSL_ERROR_NONE;
  while (count < into.size() && reason == SSL_ERROR_NONE) {
    std::size_t more = 0;
    const int outcome = ::SSL_read_ex(ssl_.get(), static_cast<std::byte*>(into.data()) + count, into.size() - count, &more);
    count += more;
    reason = ::SSL_get_error(ssl_.get(), outcome);
  }
  if (count > 0 || into.size() == 0) {  // what else there is to say comes again at the next read
    return asio::post(socket_.get_executor(), [count, handler = std::move(handler)] { handler({}, count); });
  }
  if (reason != SSL_ERROR_WANT_READ) {
    return asio::post(socket_.get_executor(), [fault = faultOf(reason), handler = std::move(handler)] { handler(fault, 0); });
  }
  receive([this, into, handler = std::move(handler)](error_code fault) mutable {
    if (fault) return handler(fault, 0);
    asyncReadSome(into, std::move(handler));
  });
}

// ---- writing
// -------------------------------------------------------------------------------

void TlsStream::asyncWrite(std::vector<asio::const_buffer> from, WriteHandler handler) {
  auto job = std::make_shared<Job>(aside_);
  job->left = asio::buffer_size(from);
  job->from = std::move(from);
  job->handler = std::move(handler);
  sendPart(std::move(job));
}

/// What was wrong, if anything: then the connection is broken.
error_code TlsStream::encryptPart(Job& job, std::size_t most) {
  ::ERR_clear_error();
  std::vector<std::byte>& out = memory_->out;
  out.reserve(std::min(most, job.left) + most / 64 + 4096);  // with what each record has beside its bytes
  while (job.piece < job.from.size() && out.size() < most) {
    const asio::const_buffer left = job.from[job.piece] + job.at;
    const std::size_t some = std::min(left.size(), most - out.size());
    std::size_t written = 0;
    if (some > 0 && ::SSL_write_ex(ssl_.get(), left.data(), some, &written) != 1) return lastFault();
    job.at += written;
    job.left -= written;
    if (job.at < job.from[job.piece].size()) continue;
    ++job.piece;
    job.at = 0;
  }
  return {};
}

void TlsStream::sendPart(std::shared_ptr<Job> job) {
  constexpr std::size_t kSmall = 64 << 10;  // is encrypted before another thread has woken
  // Alone it is with its client sooner if parts are encrypted while others are on their way.
  if (aside_ != nullptr && aside_->sending > 1 && job->left > kSmall) return encryptAside(std::move(job));
  const error_code fault = encryptPart(*job, kPart);
  if (!fault) return sendEncrypted(fault, std::move(job));
  asio::post(socket_.get_executor(), [fault, job = std::move(job)] { job->handler(fault); });
}

/// The socket's loop has something to do until the other thread is done, so that it does not end before.
void TlsStream::encryptAside(std::shared_ptr<Job> job) {
  constexpr std::size_t kMost = 4 << 20;  // is all that a client's encrypted frames take of memory
  is_aside_ = true;
  auto guard = asio::make_work_guard(socket_.get_executor());
  asio::post(aside_->threads, [this, job = std::move(job), guard = std::move(guard)]() mutable {
    error_code fault;
    try {
      fault = encryptPart(*job, kMost);
    } catch (const std::exception&) {
      fault = asio::error::no_memory;
    }
    const auto executor = guard.get_executor();
    asio::post(executor, [this, fault, job = std::move(job), guard = std::move(guard)]() mutable {
      is_aside_ = false;
      if (auto read = std::exchange(read_after_, nullptr)) read();
      sendEncrypted(fault, std::move(job));
    });
  });
}

void TlsStream::sendEncrypted(error_code fault, std::shared_ptr<Job> job) {
  if (fault) return job->handler(fault);
  send([this, job = std::move(job)](error_code broken) mutable {
    if (broken || job->piece == job->from.size()) return job->handler(broken);
    sendPart(std::move(job));
  });
}

}  // namespace toftwin::transport
