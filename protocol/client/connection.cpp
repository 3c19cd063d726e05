// SPDX-License-Identifier: Apache-2.0
#include "protocol/client/connection.h"

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/post.hpp>

#include <algorithm>

#include <toftwin/names.h>

#include "protocol/client/dial.h"

namespace toftwin::client {
namespace {

namespace asio = boost::asio;

constexpr const char* kSoftware = "toftwin client " TOFTWIN_VERSION;

std::string milliseconds(std::chrono::milliseconds time) {
  return std::to_string(time.count()) + " ms";
}

}  // namespace

// ---- any thread
// ------------------------------------------------------------------------------------

Result<std::shared_ptr<Connection>> Connection::open(const transport::Address& address,
                                                     const ClientOptions& options) {
  std::shared_ptr<Connection> connection{new Connection{address, options}};
  auto socket = dial(connection->io_, address, options.timeout);
  if (!socket) return socket.error();
  wire::Limits limits;
  limits.body_bytes = options.max_message_bytes;
  connection->socket_.emplace(std::move(*socket), limits);
  if (auto encrypted = connection->encrypt(); !encrypted) return encrypted.error();
  if (auto greeted = connection->greet(); !greeted) return greeted.error();
  connection->readOn();
  connection->keepAlive();
  connection->thread_ = std::thread{[state = connection.get()] {
    const auto stay = asio::make_work_guard(state->io_);  // until stop(), even when disconnected
    state->io_.restart();
    state->io_.run();
  }};
  return connection;
}

Connection::~Connection() { stop(); }

void Connection::stop() {
  if (!thread_.joinable()) return;
  asio::post(io_, [this] {
    fail({Error::Code::Stopped, "the client was closed"});
    io_.stop();
  });
  thread_.join();
}

/// Where the address says so; in the caller's thread, like the greeting.
Result<> Connection::encrypt() {
  const auto* tcp = std::get_if<transport::TcpAddress>(&address_);
  if (tcp == nullptr || !tcp->is_encrypted) return {};
  const auto context =
      transport::TlsContext::forClient({options_.certificate, options_.key, options_.authorities});
  if (!context) return context.error();
  std::optional<Result<>> agreed;
  socket_->asyncEncrypt(*context, tcp->host, [&](Result<> result) { agreed = std::move(result); });
  const auto deadline = std::chrono::steady_clock::now() + options_.timeout;
  io_.restart();
  while (!agreed && io_.run_one_until(deadline) > 0) {
  }
  if (!agreed) {
    socket_->close();  // ends the handshake, whose handler refers to `agreed`
    io_.restart();
    io_.run();
    agreed = Error{Error::Code::Timeout, "no TLS within " + milliseconds(options_.timeout)};
  }
  if (*agreed) return {};
  return Error{agreed->error().code, transport::toString(address_) + ": " + agreed->error().message +
                                         ". Does the daemon have a certificate of an authority that is trusted here?"};
}

/// Says Hello and waits for the daemon's; in the caller's thread, before the own one starts.
Result<> Connection::greet() {
  std::vector<std::string> features;
  if (socket_->isLocal()) {
    features.emplace_back(transport::kMemfdFeature);
    socket_->acceptSharedBodies();
  }
  std::optional<Result<wire::Message>> answer;
  wire::Hello own{next_id_++, kSoftware, features};
  own.token = options_.token;
  auto encoded = wire::encode(own);
  if (!encoded) return encoded.error();
  enqueue(*std::move(encoded));
  socket_->asyncRead([&](Result<wire::Message> message) { answer = std::move(message); });
  const auto deadline = std::chrono::steady_clock::now() + options_.timeout;
  io_.restart();
  while (!answer && io_.run_one_until(deadline) > 0) {
  }
  const std::string where = transport::toString(address_);
  if (!answer) {
    socket_->close();  // ends the read, whose handler refers to `answer`
    io_.restart();
    io_.run();
    return Error{Error::Code::Timeout, "whoever listens at " + where + " says nothing within " +
                                           milliseconds(options_.timeout) + ". Is it toftwind?"};
  }
  if (!*answer) return Error{answer->error().code, where + ": " + answer->error().message};
  if (const auto* failure = std::get_if<wire::Failure>(&**answer)) return failure->error;
  const auto* hello = std::get_if<wire::Hello>(&**answer);
  if (!hello) return Error{Error::Code::Malformed, where + ": the first message was not a Hello"};
  software_ = hello->software;
  minor_ = hello->minor;
  idle_ = hello->idle;
  return {};
}

Result<> Connection::checkKnown(const std::vector<PlaneKind>& planes) const {
  const auto newer =
      std::ranges::find_if(planes, [this](PlaneKind kind) { return kind > wire::lastPlaneKindOf(minor_); });
  if (newer == planes.end()) return {};
  return Error{Error::Code::Unsupported, "toftwind at " + transport::toString(address_) +
                                             " speaks version 1." + std::to_string(minor_) +
                                             " of the protocol, which has no plane " +
                                             std::string{nameOf(*newer)} + ": a newer toftwind has"};
}

/// An older one would read the number that is beside the text.
Result<> Connection::checkKnowsTexts() const {
  if (minor_ >= wire::kFirstMinorWithTexts) return {};
  return Error{Error::Code::Unsupported,
               "toftwind at " + transport::toString(address_) + " speaks version 1." +
                   std::to_string(minor_) +
                   " of the protocol, whose parameters are numbers: a newer toftwind's are "
                   "texts, too"};
}

Error Connection::unexpectedAnswer() const {
  return {Error::Code::Malformed,
          "toftwind at " + transport::toString(address_) + " gave an answer of another kind"};
}

Result<wire::Message> Connection::exchange(std::uint64_t id, wire::Message request) {
  auto encoded = wire::encode(request);
  if (!encoded) return encoded.error();
  const auto answered = std::make_shared<Answered>();
  auto answer = answered->get_future();
  asio::post(io_, [this, id, answered, encoded = *std::move(encoded)]() mutable {
    if (fault_) return answered->set_value(*fault_);
    waiting_.emplace(id, answered);
    enqueue(std::move(encoded));
  });
  if (answer.wait_for(options_.timeout) == std::future_status::ready) return answer.get();
  asio::post(io_, [this, id] { waiting_.erase(id); });
  return Error{Error::Code::Timeout, "toftwind at " + transport::toString(address_) +
                                         " did not answer within " +
                                         milliseconds(options_.timeout)};
}

Result<Connection::Subscribed> Connection::subscribe(wire::Subscribe request) {
  request.id = next_id_++;
  request.window = windowOf(request.policy);
  const auto frames = std::make_shared<Inbox>(request.policy);
  // Frames may follow the answer at once, so the thread must know the queue before.
  asio::post(io_, [this, id = request.id, frames] { starting_.emplace(id, frames); });
  Result<wire::Message> answer = exchange(request.id, request);
  asio::post(io_, [this, id = request.id] { starting_.erase(id); });
  if (!answer) return answer.error();
  if (auto* failure = std::get_if<wire::Failure>(&*answer)) return std::move(failure->error);
  const auto* subscribed = std::get_if<wire::Subscribed>(&*answer);
  if (!subscribed) return unexpectedAnswer();
  return Subscribed{subscribed->subscription, frames};
}

void Connection::unsubscribe(std::uint64_t subscription) {
  asio::post(io_, [this, subscription] {
    if (running_.erase(subscription) == 0) return;  // the daemon ended it already
    if (!fault_) enqueue(*wire::encode(wire::Unsubscribe{next_id_++, subscription}));
  });
}

void Connection::acknowledge(std::uint64_t subscription, std::uint64_t sequence) {
  asio::post(io_, [this, subscription, sequence] {
    if (!fault_) enqueue(*wire::encode(wire::Acknowledge{subscription, sequence}));
  });
}

// ---- the thread
// ------------------------------------------------------------------------------------

void Connection::enqueue(wire::Encoded message) {
  output_.push_back(std::move(message));
  if (!writing_) writeNext();
}

void Connection::writeNext() {
  writing_ = !output_.empty();
  if (!writing_) return;
  wire::Encoded next = std::move(output_.front());
  output_.pop_front();
  socket_->asyncWrite(std::move(next), [this](const Result<>& result) {
    if (!result) return fail(result.error());
    writeNext();
  });
}

void Connection::readOn() {
  socket_->asyncRead([this](Result<wire::Message> message) {
    if (message) {
      take(std::move(*message));
    } else if (message.error().code !=
               Error::Code::Unsupported) {  // else from a newer daemon: skip
      return fail(message.error());
    }
    if (!fault_) readOn();
  });
}

/// Says that this client lives, whatever its application does, three times within what the daemon waits.
void Connection::keepAlive() {
  if (!idle_ || minor_ < wire::kFirstMinorWithKeepAlive || fault_) return;
  const std::chrono::duration<double> period{std::clamp(idle_->in(second) / 3.0, 0.05, 3600.0)};
  keep_alive_.expires_after(std::chrono::duration_cast<std::chrono::steady_clock::duration>(period));
  keep_alive_.async_wait([this](boost::system::error_code cancelled) {
    if (cancelled || fault_) return;
    enqueue(*wire::encode(wire::KeepAlive{}));
    keepAlive();
  });
}

void Connection::take(wire::Message message) {
  std::visit(
      [this](auto& m) {
        using M = std::decay_t<decltype(m)>;
        if constexpr (std::is_same_v<M, wire::FrameMessage>) {
          takeFrame(std::move(m));
        } else if constexpr (std::is_same_v<M, wire::SubscriptionEnded>) {
          const auto entry = running_.find(m.subscription);
          if (entry == running_.end()) return;
          entry->second->end(std::move(m.reason));
          running_.erase(entry);
        } else if constexpr (std::is_same_v<M, wire::Failure>) {
          if (m.id == 0) return fail(m.error);
          takeAnswer(m.id, std::move(m));
        } else if constexpr (requires { m.id; }) {
          takeAnswer(m.id, std::move(m));
        }
      },
      message);
}

void Connection::takeFrame(wire::FrameMessage message) {
  const auto entry = running_.find(message.subscription);
  if (entry == running_.end()) return;  // sent before the daemon read our Unsubscribe
  Inbox& frames = *entry->second;
  const std::uint64_t sequence = message.frame.sequence;
  if (auto pushed = frames.push(std::move(message.frame)); !pushed) {
    frames.end(pushed.error());
    running_.erase(entry);
    return enqueue(*wire::encode(wire::Unsubscribe{next_id_++, message.subscription}));
  }
  if (frames.isAcknowledgedOnArrival()) {
    enqueue(*wire::encode(wire::Acknowledge{message.subscription, sequence}));
  }
}

void Connection::takeAnswer(std::uint64_t id, wire::Message answer) {
  const auto entry = waiting_.find(id);
  const auto* subscribed = std::get_if<wire::Subscribed>(&answer);
  if (entry == waiting_.end()) {  // too late: nobody waits for it any more
    if (subscribed) {
      enqueue(*wire::encode(wire::Unsubscribe{next_id_++, subscribed->subscription}));
    }
    return;
  }
  if (subscribed) {
    const auto frames = starting_.find(id);
    if (frames != starting_.end()) running_.emplace(subscribed->subscription, frames->second);
  }
  const auto answered = entry->second;
  waiting_.erase(entry);
  answered->set_value(std::move(answer));
}

void Connection::fail(const Error& reason) {
  if (fault_) return;
  const bool is_ours = reason.code == Error::Code::Stopped;
  const std::string where =
      "connection to toftwind at " + transport::toString(address_) + " lost: ";
  fault_ =
      is_ours ? reason
              : Error{reason.code, where + reason.message + ". Is it still running? Connect again"};
  socket_->close();
  keep_alive_.cancel();
  output_.clear();
  for (const auto& [id, answered] : std::exchange(waiting_, {})) answered->set_value(*fault_);
  for (const auto& [id, frames] : std::exchange(running_, {})) frames->end(*fault_);
}

}  // namespace toftwin::client
