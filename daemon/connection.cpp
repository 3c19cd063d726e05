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
      hooks_.log->warn(peer_.name(), "{}: {}; closing", name_, why.message);
      return dismiss(why);
    } catch (...) {
      close();
    }
  }
}

Session::Options Connection::sessionOptions() const {
  Session::Options session{.subscriptions = options_.subscriptions, .features = {}};
  if (socket_.isLocal()) session.features.emplace_back(transport::kMemfdFeature);
  session.who = {.name = peer_.name(),
                 .text = fmt::format("{} ({})", peer_.name(), name_),
                 .lockstep_patience = options_.lockstep_wait};
  if (hooks_.access) {
    session.identify = [access = hooks_.access, peer = peer_, name = socket_.certifiedName()](const wire::Hello& hello) {
      return access->identify(peer, hello.token, name);
    };
  }
  session.idle = std::chrono::duration<double>{options_.idle}.count() * second;
  return session;
}

Connection::Connection(Socket socket, Hub& hub, Options options, std::string name, Hooks hooks)
    : socket_(std::move(socket),
              wire::Limits{.header_bytes = options.request_bytes, .body_bytes = 0}),
      options_(options),
      peer_(peerOf(socket_.socket())),
      name_(std::move(name)),
      hooks_(std::move(hooks)),
      timer_(socket_.socket().get_executor()),
      hub_(&hub) {}

void Connection::start() {
  transport::setNoDelay(socket_.socket());
  if (!socket_.isLocal()) noticeVanishedPeer(socket_.socket().native_handle(), options_.patience);
  giveUpAfter(options_.handshake, [this] {
    if (!session_) return close();
    if (session_->isOpen()) return;
    dismiss(
        {Error::Code::Timeout, fmt::format("no Hello within {} ms", options_.handshake.count())});
  });
  if (!hooks_.tls || socket_.isLocal()) return begin();
  auto under_way = std::make_shared<UnderWay>(shared_from_this());
  socket_.asyncEncrypt(hooks_.tls, {}, [this, under_way](const Result<>& agreed) {
    under_way->is_over = true;
    if (is_closed_) return;
    if (agreed) return guarded([&] { begin(); });
    guarded([&] { hooks_.log->warn(peer_.name(), "{}, {}: {}", name_, peer_.name(), agreed.error().message); });
    close();
  });
}

/// Once nobody else can listen. Not in the constructor: the waker holds this connection weakly, which needs one that is owned.
void Connection::begin() {
  session_ = std::make_unique<Session>(*hub_, sessionOptions(), waker());
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
  heard_ = std::chrono::steady_clock::now();
  if (message && !is_admitted_) {
    if (auto admitted = admit(*message); !admitted) return dismiss(admitted.error());
  }
  if (message) {
    const auto* subscribe = std::get_if<wire::Subscribe>(&*message);
    if (subscribe != nullptr && subscribe->policy == wire::Policy::Lockstep) {
      noticeVanishedPeer(socket_.socket().native_handle(), options_.lockstep_patience);  // it holds others up
    }
    for (wire::Message& answer : session_->handle(*message)) answers_.push_back(std::move(answer));
    if (session_->isOver()) is_last_ = true;
    if (std::holds_alternative<wire::Hello>(*message) && !is_last_) waitWhileIdle();
  } else if (message.error().code == Error::Code::Unsupported) {
    answers_.emplace_back(wire::Failure{socket_.refusedRequest(), message.error()});
  } else if (message.error().code == Error::Code::Disconnected) {
    return close();
  } else {
    hooks_.log->warn(peer_.name(), "{}, {}: {}; closing", name_, peer_.name(), message.error().message);
    return dismiss(message.error());
  }
  read();
  pump();
}

/// What is no Hello is the session's matter, which refuses it.
Result<> Connection::admit(const wire::Message& first) {
  if (!std::holds_alternative<wire::Hello>(first)) return {};
  const Result<> admitted = hooks_.admit();
  is_admitted_ = admitted.ok();
  return admitted;
}

/// Older clients know no KeepAlive: whatever they do is taken for life, as long as their place is not needed.
void Connection::waitWhileIdle() {
  if (session_->client()->minor < wire::kFirstMinorWithKeepAlive) return timer_.cancel(), void();
  const auto silence = std::chrono::steady_clock::now() - heard_;
  if (silence >= options_.idle) {
    return dismiss({Error::Code::Timeout, fmt::format("nothing was heard from this client for {} ms (limits.idle_s)",
                                                      options_.idle.count())});
  }
  const auto rest = std::chrono::duration_cast<std::chrono::milliseconds>(options_.idle - silence);
  giveUpAfter(rest + std::chrono::milliseconds{1}, [this] {
    if (!is_last_) waitWhileIdle();
  });
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
  frame_made_.reset();
  if (const auto* message = std::get_if<wire::Message>(&outgoing)) {
    return socket_.asyncWrite(encodeOrFailure(*message), sent);
  }
  const auto& [subscription, delivery, bodies] = std::get<Session::FrameOut>(outgoing);
  wire::FrameMessage message{subscription, delivery.frame->frame};
  message.frame.dropped_before = delivery.dropped_before;
  frame_made_ = delivery.frame->made_at;
  hub_->traffic().dropped += delivery.dropped_before;
  hub_->traffic().bytes += delivery.frame->body.bytes;
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
  if (frame_made_) {
    ++hub_->traffic().frames;
    hub_->traffic().latency.count(std::chrono::steady_clock::now() - *frame_made_);
  }
  pump();
  if (!is_closed_) read();
}

void Connection::dismiss(Error why) {
  if (is_closed_ || is_last_) return;
  if (!session_) return close();  // nothing can be told before there are keys
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
  if (hooks_.on_closed) std::exchange(hooks_.on_closed, nullptr)();
}

}  // namespace toftwin::daemon
