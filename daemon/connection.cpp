// SPDX-License-Identifier: Apache-2.0
#include "daemon/connection.h"

#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>

#include <fmt/format.h>

#include <algorithm>

#include "daemon/thrown.h"
#include "daemon/vanished_peer.h"
#include "drivers/logging.h"
#include "protocol/wire/message_id.h"

namespace toftwin::daemon {
namespace {

namespace asio = boost::asio;
using transport::Socket;

constexpr std::size_t kMostOwed = 64;  // answers; a client that asks on must read some first
constexpr std::chrono::milliseconds kFarewell{1000};

Session::Options sessionOptions(const Connection::Options& options, bool is_local) {
  Session::Options session{.subscriptions = options.subscriptions, .features = {}};
  if (is_local) session.features.emplace_back(transport::kMemfdFeature);
  return session;
}

/// An answer that the protocol cannot carry (a driver's name that is too long, an interval that is not a
/// number) becomes a Failure that says so.
wire::Encoded encodeOrFailure(const wire::Message& answer) {
  auto encoded = wire::encode(answer);
  if (encoded) return *std::move(encoded);
  return *wire::encode(wire::Failure{wire::idOf(answer), {Error::Code::Internal, encoded.error().message}});
}

}  // namespace

/// Held by what a read or a write calls in the end. Should something be thrown on the way there, then
/// nobody calls, and the connection is closed.
struct Connection::UnderWay {
  explicit UnderWay(std::shared_ptr<Connection> of) : connection(std::move(of)) {}
  ~UnderWay() {
    if (!is_over) connection->close();
  }
  UnderWay(const UnderWay&) = delete;
  UnderWay& operator=(const UnderWay&) = delete;
  const std::shared_ptr<Connection> connection;  // shared with the server and other handlers
  bool is_over = false;
};

/// Whatever is thrown while this client is served, for want of memory or of threads, ends this client's
/// connection and nothing else; it is told why if that is still possible.
template <class Work>
void Connection::guarded(Work work) noexcept {
  try {
    return work();
  } catch (...) {
    try {
      const Error why = thrownError("serving this client");
      logging::error("{}: {}; closing", name_, why.message);
      return dismiss(why);
    } catch (...) {
      close();
    }
  }
}

Connection::Connection(Socket socket, Hub& hub, Options options, std::string name,
                       std::function<void()> on_closed)
    : socket_(std::move(socket),
              wire::Limits{.header_bytes = options.request_bytes, .body_bytes = 0}),
      options_(options),
      name_(std::move(name)),
      on_closed_(std::move(on_closed)),
      timer_(socket_.socket().get_executor()),
      hub_(&hub) {}

void Connection::start() {
  transport::setNoDelay(socket_.socket());
  if (!socket_.isLocal()) noticeVanishedPeer(socket_.socket().native_handle(), options_.patience);
  // Not in the constructor: the waker holds this connection weakly, which needs one that is owned.
  session_ = std::make_unique<Session>(*hub_, sessionOptions(options_, socket_.isLocal()), waker());
  giveUpAfter(options_.handshake, [this] {
    if (session_->isOpen()) return;
    dismiss(
        {Error::Code::Timeout, fmt::format("no Hello within {} ms", options_.handshake.count())});
  });
  read();
}

/// What sources and recorders call, on their threads, when there is something to send. However
/// often that is, one visit to the io thread at a time is on its way.
std::function<void()> Connection::waker() {
  return [weak = weak_from_this()] {
    auto self = weak.lock();
    if (!self || self->is_wake_posted_.exchange(true)) return;
    auto executor = self->socket_.socket().get_executor();
    try {
      asio::post(executor, [self] {
        self->is_wake_posted_ = false;
        self->guarded([&] { self->pump(); });
      });
    } catch (...) {
      self->is_wake_posted_ = false;
      throw;
    }
  };
}

void Connection::read() {
  if (is_reading_ || is_closed_ || is_last_) return;
  if (answers_.size() + session_->owed() >= kMostOwed) return;  // read again when some were sent
  auto under_way = std::make_shared<UnderWay>(shared_from_this());
  is_reading_ = true;
  socket_.asyncRead([this, under_way](Result<wire::Message> message) {
    under_way->is_over = true;
    is_reading_ = false;
    guarded([&] { take(std::move(message)); });
  });
}

void Connection::take(Result<wire::Message> message) {
  if (is_closed_) return;
  if (is_last_) {
    // Too late for whatever it was; if all is said, only the peer's end is waited for.
    const bool is_gone = !message && message.error().code == Error::Code::Disconnected;
    if (is_gone) return close();
    if (is_hung_up_) drain();
    return;
  }
  if (message) {
    const auto* subscribe = std::get_if<wire::Subscribe>(&*message);
    if (subscribe != nullptr && subscribe->policy == wire::Policy::Lockstep) {
      noticeVanishedPeer(socket_.socket().native_handle(), options_.lockstep_patience);  // it holds others up
    }
    for (wire::Message& answer : session_->handle(*message)) answers_.push_back(std::move(answer));
    if (session_->isOver()) is_last_ = true;
  } else if (message.error().code == Error::Code::Unsupported) {
    answers_.emplace_back(wire::Failure{socket_.refusedRequest(), message.error()});
  } else if (message.error().code == Error::Code::Disconnected) {
    return close();
  } else {
    logging::warn("{}: {}; closing", name_, message.error().message);
    return dismiss(message.error());
  }
  read();
  pump();
}

void Connection::pump() {
  if (is_writing_ || is_closed_) return;
  if (!answers_.empty()) {
    const wire::Message answer = std::move(answers_.front());
    answers_.pop_front();
    return send(answer);
  }
  if (is_last_) return hangUp();
  if (auto outgoing = session_->next()) send(*outgoing);
}

void Connection::send(const Session::Outgoing& outgoing) {
  auto under_way = std::make_shared<UnderWay>(shared_from_this());
  const auto sent = [this, under_way = std::move(under_way)](const Result<>& result) {
    under_way->is_over = true;
    guarded([&] { this->sent(result); });
  };
  is_writing_ = true;
  if (const auto* message = std::get_if<wire::Message>(&outgoing)) {
    return socket_.asyncWrite(encodeOrFailure(*message), sent);
  }
  const auto& [subscription, delivery, bodies] = std::get<Session::FrameOut>(outgoing);
  wire::FrameMessage message{subscription, delivery.frame->frame};
  message.frame.dropped_before = delivery.dropped_before;
  // The copy before the CRC, which another thread computes meanwhile.
  auto shared = bodies ? delivery.frame->sharedBody(*bodies) : nullptr;
  auto encoded = wire::encode(message, delivery.frame->summedBody());
  if (!encoded) {  // it could be encoded when it was prepared, so this is a mistake in this program
    logging::error("{}: {}; closing", name_, encoded.error().message);
    return close();
  }
  if (shared) {
    return socket_.asyncWrite(*std::move(encoded), std::move(shared), sent);
  }
  socket_.asyncWrite(*std::move(encoded), sent);
}

void Connection::sent(const Result<>& result) {
  is_writing_ = false;
  if (!result) return close();
  pump();
  if (!is_closed_) read();
}

void Connection::dismiss(Error why) {
  if (is_closed_ || is_last_) return;
  // What the session has to tell (ends of subscriptions, late answers) goes first; frames do not.
  while (auto outgoing = session_->next()) {
    if (auto* message = std::get_if<wire::Message>(&*outgoing))
      answers_.push_back(std::move(*message));
  }
  answers_.emplace_back(wire::Failure{0, std::move(why)});
  is_last_ = true;
  giveUpAfter(kFarewell, [this] { close(); });  // even if the client does not read
  pump();
}

/// Ends this side's direction and reads what the peer still sends: closing over unread bytes would
/// make the kernel throw away the last message on its way.
void Connection::hangUp() {
  if (std::exchange(is_hung_up_, true)) return;
  giveUpAfter(kFarewell, [this] { close(); });
  boost::system::error_code ignored;
  socket_.socket().shutdown(Socket::shutdown_send, ignored);
  if (!is_reading_) drain();
}

void Connection::drain() {
  socket_.socket().async_read_some(
      asio::buffer(scratch_),
      [self = shared_from_this()](boost::system::error_code fault, std::size_t) {
        if (fault) return self->close();
        self->drain();
      });
}

void Connection::giveUpAfter(std::chrono::milliseconds timeout, std::function<void()> then) {
  timer_.expires_after(timeout);
  timer_.async_wait(
      [self = shared_from_this(), then = std::move(then)](boost::system::error_code fault) {
        if (!fault && !self->is_closed_) self->guarded([&] { then(); });
      });
}

void Connection::close() noexcept {
  if (is_closed_) return;
  const auto kept = weak_from_this().lock();  // the server lets go of it below
  is_closed_ = true;
  boost::system::error_code ignored;
  timer_.cancel(ignored);
  socket_.close();
  session_.reset();  // its subscriptions end now, not when the last handler has run
  if (on_closed_) std::exchange(on_closed_, nullptr)();
}

}  // namespace toftwin::daemon
