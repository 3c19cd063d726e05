// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3d303/pcic_server.h"

#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <deque>
#include <optional>
#include <vector>

#include "daemon/facades/o3d303/commands.h"

namespace toftwin::daemon::o3d303 {
namespace {

using boost::asio::ip::tcp;
using boost::system::error_code;
using toftwin::o3d303::Bytes;
using toftwin::o3d303::Schema;

constexpr std::size_t kMostPcicConnections = 16;
constexpr std::size_t kLongestCommand = 128 << 10;
/// For one connection; more are lost. Two that the line doubles may leave at once.
constexpr std::size_t kMostFramesWaiting = 6;
constexpr std::size_t kMostMessagesWaiting = 64;    ///< one that asks and never reads is closed
constexpr int kVersion = 3;                         ///< of the protocol, the only one that is spoken
constexpr std::chrono::seconds kFramePatience{10};  ///< with a frame that was triggered
constexpr std::chrono::seconds kCutPatience{1};  ///< with a client that does not take the half that is left
/// Shared by the connections that send them.
using SharedBytes = std::shared_ptr<const Bytes>;

std::string errorText(int code) { return fmt::format("{:09}", code); }

void closeHard(tcp::socket& socket) {
  error_code ignored;
  socket.close(ignored);
}

}  // namespace

class PcicServer::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(PcicServer& server, tcp::socket socket, int number)
      : server_(server),
        alive_(server.is_alive_),
        number_(number),
        socket_(std::move(socket)),
        ends_(socket_.get_executor()),
        waits_(socket_.get_executor()) {
    error_code ignored;
    socket_.set_option(tcp::no_delay{true}, ignored);
    socket_.set_option(boost::asio::socket_base::keep_alive{true}, ignored);
  }
  /// What it gets a frame by; nothing if it wants none.
  [[nodiscard]] std::optional<Schema> wanted() const {
    if ((output_ & Output::kResults) == 0) return std::nullopt;
    return schema();
  }
  [[nodiscard]] Schema schema() const { return schema_ ? *schema_ : server_.hooks_.default_schema(); }
  [[nodiscard]] bool takes(unsigned output) const { return (output_ & output) != 0; }
  [[nodiscard]] int number() const { return number_; }
  /// Whether the frame was waited for, and is the answer.
  bool answerWith(const toftwin::o3d303::CameraFrame& frame) {
    if (!waiting_ticket_) return false;
    const std::string ticket = *std::exchange(waiting_ticket_, std::nullopt);
    waits_.cancel();
    const auto content = writeFrameContent(withoutMarkers(schema()), frame);
    content ? replyWith(ticket, *content) : reply(ticket, toftwin::o3d303::kRefused);
    return true;
  }

  void read() {
    socket_.async_read_some(boost::asio::buffer(piece_),
                            [self = shared_from_this()](error_code error, std::size_t size) {
                              if (error || !*self->alive_) return self->close();
                              if (self->is_ending_) return self->read();
                              self->reader_.feed(std::span{self->piece_}.first(size));
                              if (self->obeyAll()) self->read();
                            });
  }
  /// False if it takes no more.
  bool send(SharedBytes bytes, bool is_frame) {
    if (is_ending_) return false;
    if (is_frame && frames_waiting_ >= kMostFramesWaiting) return false;
    if (queue_.size() >= kMostMessagesWaiting) return close(), false;
    frames_waiting_ += is_frame ? 1 : 0;
    queue_.push_back({std::move(bytes), is_frame});
    if (queue_.size() == 1) write();
    return true;
  }
  void tellError(int code) { reply(toftwin::o3d303::kErrorTicket, errorText(code)); }
  /// What is under way, then these bytes, and the connection ends, whether or not the client takes them.
  bool endWith(SharedBytes bytes) {
    if (is_ending_) return false;
    is_ending_ = true;
    if (queue_.size() > 1) queue_.erase(queue_.begin() + 1, queue_.end());
    queue_.push_back({std::move(bytes), false});
    if (queue_.size() == 1) write();
    ends_.expires_after(kCutPatience);
    ends_.async_wait([self = shared_from_this()](error_code cancelled) {
      if (!cancelled) self->close();
    });
    return true;
  }
  void close() {
    ends_.cancel();
    waits_.cancel();
    closeHard(socket_);
    if (*alive_) server_.remove(shared_from_this());
  }

 private:
  struct Waiting {
    SharedBytes bytes;
    bool is_frame;
  };

  /// False if the connection was closed.
  bool obeyAll() {
    while (true) {
      auto message = reader_.next();
      if (!message) return close(), false;
      if (!*message) return true;
      obey(**message);
      if (!socket_.is_open()) return false;
    }
  }
  void obey(const toftwin::o3d303::PcicMessage& message) {
    const Command command = readCommand(toftwin::o3d303::textOf(message.content));
    switch (command.kind) {
      case Command::Kind::SetSchema:
        schema_ = command.schema;
        schema_text_ = command.schema_text;
        return reply(message.ticket, toftwin::o3d303::kDone);
      case Command::Kind::SetOutput:
        output_ = command.output;
        return reply(message.ticket, toftwin::o3d303::kDone);
      case Command::Kind::AskSchema: {
        const std::string json = schema_ ? schema_text_ : server_.hooks_.default_schema_text();
        return reply(message.ticket, fmt::format("{:09}{}", json.size(), json));
      }
      case Command::Kind::Trigger:
        return trigger(message.ticket);
      case Command::Kind::TriggerAndWait:
        return triggerAndWait(message.ticket);
      case Command::Kind::AskError:
        return reply(message.ticket, errorText(server_.last_error_));
      case Command::Kind::AskImage:
        return replyImage(message.ticket, command.number);
      case Command::Kind::AskConnection:
        return reply(message.ticket, fmt::format("{:03}", number_));
      case Command::Kind::AskCommands:
        return reply(message.ticket, listOfCommands());
      case Command::Kind::Activate:
        return activate(message.ticket, command.number);
      case Command::Kind::SetVersion:
        return reply(message.ticket,
                     command.number == kVersion ? toftwin::o3d303::kDone : toftwin::o3d303::kRefused);
      case Command::Kind::SetWire:
      case Command::Kind::AskWire:
        return wire(message.ticket, command);
      case Command::Kind::Refused:
        return reply(message.ticket, toftwin::o3d303::kRefused);
      case Command::Kind::Other:
        break;
    }
    const std::string answer = server_.hooks_.ask(toftwin::o3d303::textOf(message.content));
    answer.empty() ? reply(message.ticket, toftwin::o3d303::kUnknown) : reply(message.ticket, answer);
  }
  void trigger(const std::string& ticket) {
    server_.hooks_.trigger([self = shared_from_this(), ticket](int error) {
      self->reply(ticket, error == 0 ? toftwin::o3d303::kDone : toftwin::o3d303::kRefused);
      if (error != 0 && *self->alive_) self->server_.tellError(error);
    });
  }
  /// The frame is the answer, without being sent to this connection once more.
  void triggerAndWait(const std::string& ticket) {
    if (waiting_ticket_) return reply(ticket, toftwin::o3d303::kRefused);
    waiting_ticket_ = ticket;
    waits_.expires_after(kFramePatience);
    waits_.async_wait([weak = weak_from_this()](error_code cancelled) {
      const auto self = weak.lock();
      if (!cancelled && self) self->stopWaiting();
    });
    server_.hooks_.trigger([self = shared_from_this()](int error) {
      if (error == 0) return;
      self->stopWaiting();
      if (*self->alive_) self->server_.tellError(error);
    });
  }
  void stopWaiting() {
    waits_.cancel();
    if (waiting_ticket_) reply(*std::exchange(waiting_ticket_, std::nullopt), toftwin::o3d303::kRefused);
  }
  void replyImage(const std::string& ticket, int number) {
    constexpr int kLastResult = 10;
    const auto* frame = server_.hooks_.last_frame();
    const Schema wanted = number == kLastResult ? withoutMarkers(schema()) : schemaOfImage(number);
    if (frame == nullptr || wanted.empty()) return reply(ticket, toftwin::o3d303::kRefused);
    const auto content = writeFrameContent(wanted, *frame);
    if (!content) return reply(ticket, toftwin::o3d303::kRefused);
    Bytes answer;
    toftwin::o3d303::appendText(answer, fmt::format("{:09}", content->size()));
    answer.insert(answer.end(), content->begin(), content->end());
    replyWith(ticket, answer);
  }
  void activate(const std::string& ticket, int index) {
    server_.hooks_.activate(index, [self = shared_from_this(), ticket](bool is_done) {
      self->reply(ticket, is_done ? toftwin::o3d303::kDone : toftwin::o3d303::kRefused);
    });
  }
  void wire(const std::string& ticket, const Command& command) {
    if (command.number < 1 || command.number > kWires) return reply(ticket, toftwin::o3d303::kRefused);
    bool& is_high = server_.wires_[static_cast<std::size_t>(command.number) - 1];
    if (command.kind == Command::Kind::AskWire)
      return reply(ticket, fmt::format("{:02}{}", command.number, is_high ? 1 : 0));
    is_high = command.is_high;
    reply(ticket, toftwin::o3d303::kDone);
  }
  void reply(std::string_view ticket, char answer) { reply(ticket, std::string_view{&answer, 1}); }
  void reply(std::string_view ticket, std::string_view answer) {
    if (!socket_.is_open()) return;
    send(std::make_shared<const Bytes>(toftwin::o3d303::encodePcic(ticket, answer)), false);
  }
  void replyWith(std::string_view ticket, const Bytes& answer) {
    reply(ticket, toftwin::o3d303::textOf(answer));
  }
  void write() {
    boost::asio::async_write(socket_, boost::asio::buffer(*queue_.front().bytes),
                             [self = shared_from_this()](error_code error, std::size_t) {
                               if (error || !*self->alive_) return self->close();
                               self->frames_waiting_ -= self->queue_.front().is_frame ? 1 : 0;
                               self->queue_.pop_front();
                               if (!self->queue_.empty()) return self->write();
                               if (self->is_ending_) self->close();
                             });
  }

  PcicServer& server_;
  const std::shared_ptr<bool> alive_;
  const int number_;
  tcp::socket socket_;
  boost::asio::steady_timer ends_, waits_;
  std::optional<std::string> waiting_ticket_;  ///< of "T?"
  toftwin::o3d303::PcicReader reader_{kLongestCommand};
  std::array<std::byte, 4096> piece_{};
  std::optional<Schema> schema_;
  std::string schema_text_;
  unsigned output_ = Output::kAll;
  std::deque<Waiting> queue_;
  std::size_t frames_waiting_ = 0;
  bool is_ending_ = false;  ///< takes no more, and obeys no more
};

PcicServer::PcicServer(tcp::acceptor acceptor, Hooks hooks)
    : hooks_(std::move(hooks)),
      accepting_(std::move(acceptor), [this](tcp::socket socket) { take(std::move(socket)); }) {}

PcicServer::~PcicServer() {
  *is_alive_ = false;
  for (const auto& connection : connections_) connection->close();
}

void PcicServer::setOpen(bool is_open) {
  is_open_ = is_open;
  if (is_open) return;
  const auto all = connections_;
  for (const auto& connection : all) connection->close();
}

void PcicServer::take(tcp::socket socket) {
  if (!is_open_) return;
  if (connections_.size() >= kMostPcicConnections) return tellError(PcicError::kTooManyConnections);
  auto connection = std::make_shared<Connection>(*this, std::move(socket), freeNumber());
  connections_.push_back(connection);
  hooks_.connections(connections_.size());
  connection->read();
  if (const int error = hooks_.lasting_error(); error != 0) connection->tellError(error);
}

/// The least that no connection has.
int PcicServer::freeNumber() const {
  int number = 1;
  const auto isTaken = [&](const auto& connection) { return connection->number() == number; };
  while (std::ranges::any_of(connections_, isTaken)) ++number;
  return number;
}

void PcicServer::remove(const std::shared_ptr<Connection>& connection) {
  const std::size_t before = connections_.size();
  connections_.remove(connection);
  if (connections_.size() != before) hooks_.connections(connections_.size());
}

bool PcicServer::publish(const toftwin::o3d303::CameraFrame& frame, const Damage& damage) {
  std::vector<std::pair<Schema, SharedBytes>> made;
  const auto all = connections_;  // sending may close one
  bool has_left = false;
  for (const auto& connection : all) {
    if (connection->answerWith(frame)) {
      has_left = true;
      continue;
    }
    const auto schema = connection->wanted();
    if (!schema) continue;
    auto found = std::ranges::find(made, *schema, &std::pair<Schema, SharedBytes>::first);
    if (found == made.end()) {
      const auto content = writeFrameContent(*schema, frame);
      if (!content) continue;  // no schema comes here that was not checked
      const std::span<const std::byte> bytes{*content};
      Bytes message = toftwin::o3d303::encodePcic(toftwin::o3d303::kFrameTicket, bytes);
      damage.corrupt(message);
      if (damage.is_cut) message.resize(message.size() / 2);
      made.emplace_back(*schema, std::make_shared<const Bytes>(std::move(message)));
      found = made.end() - 1;
    }
    has_left |= damage.is_cut ? connection->endWith(found->second) : connection->send(found->second, true);
  }
  return has_left;
}

void PcicServer::tellError(int code) {
  last_error_ = code;
  tell(toftwin::o3d303::kErrorTicket, Output::kErrors, errorText(code));
}

void PcicServer::tellNotification(int code, std::string_view json) {
  tell(toftwin::o3d303::kNotificationTicket, Output::kNotifications, fmt::format("{:09}:{}", code, json));
}

void PcicServer::tell(std::string_view ticket, unsigned output, std::string_view text) {
  const auto bytes = std::make_shared<const Bytes>(toftwin::o3d303::encodePcic(ticket, text));
  const auto all = connections_;
  for (const auto& connection : all) {
    if (connection->takes(output)) connection->send(bytes, false);
  }
}

}  // namespace toftwin::daemon::o3d303
