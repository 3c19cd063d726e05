// SPDX-License-Identifier: Apache-2.0
// What a client's commands do.
#include "daemon/facades/ifm/pcic_connection.h"

#include <utility>

namespace toftwin::daemon::ifm {
namespace {

using boost::system::error_code;
using toftwin::o3d303::Bytes;
using toftwin::o3d303::Schema;

constexpr int kOldest = 1, kNewest = 4;             ///< versions of the protocol
constexpr std::chrono::seconds kFramePatience{10};  ///< with a frame that was triggered

}  // namespace

void PcicConnection::obey(const toftwin::o3d303::PcicMessage& message) {
  const Command command = readCommand(toftwin::o3d303::textOf(message.content), shared_.hooks.serves);
  switch (command.kind) {
    case Command::Kind::SetSchema:
      schema_ = command.schema;
      schema_text_ = command.schema_text;
      return reply(message.ticket, toftwin::o3d303::kDone);
    case Command::Kind::SetOutput:
      output_ = command.output;
      return reply(message.ticket, toftwin::o3d303::kDone);
    case Command::Kind::AskSchema: {
      const std::string json = schema_ ? schema_text_ : shared_.hooks.default_schema_text();
      return reply(message.ticket, fmt::format("{:09}{}", json.size(), json));
    }
    case Command::Kind::Trigger:
      return trigger(message.ticket);
    case Command::Kind::TriggerAndWait:
      return triggerAndWait(message.ticket);
    case Command::Kind::AskError:
      return reply(message.ticket, fmt::format("{:09}", shared_.last_error));
    case Command::Kind::AskImage:
      return replyImage(message.ticket, command.number);
    case Command::Kind::AskConnection:
      return reply(message.ticket, fmt::format("{:03}", number_));
    case Command::Kind::AskCommands:
      return reply(message.ticket, listOfCommands());
    case Command::Kind::Activate:
      return activate(message.ticket, command.number);
    case Command::Kind::SetVersion:
      return setVersion(message.ticket, command.number);
    case Command::Kind::AskVersion:
      return reply(message.ticket,
                   fmt::format("{:02} {:02} {:02}", static_cast<int>(version_), kOldest, kNewest));
    case Command::Kind::SetWire:
    case Command::Kind::AskWire:
      return wire(message.ticket, command);
    case Command::Kind::Refused:
      return reply(message.ticket, toftwin::o3d303::kRefused);
    case Command::Kind::Other:
      break;
  }
  const std::string answer = shared_.hooks.ask(toftwin::o3d303::textOf(message.content));
  answer.empty() ? reply(message.ticket, toftwin::o3d303::kUnknown) : reply(message.ticket, answer);
}

void PcicConnection::trigger(const std::string& ticket) {
  shared_.hooks.trigger([self = shared_from_this(), ticket](int error) {
    self->reply(ticket, error == 0 ? toftwin::o3d303::kDone : toftwin::o3d303::kRefused);
    if (error != 0 && *self->alive_) self->shared_.tell_error(error);
  });
}

void PcicConnection::triggerAndWait(const std::string& ticket) {
  if (waiting_ticket_) return reply(ticket, toftwin::o3d303::kRefused);
  waiting_ticket_ = ticket;
  waits_.expires_after(kFramePatience);
  waits_.async_wait([weak = weak_from_this()](error_code cancelled) {
    const auto self = weak.lock();
    if (!cancelled && self) self->stopWaiting();
  });
  shared_.hooks.trigger([self = shared_from_this()](int error) {
    if (error == 0) return;
    self->stopWaiting();
    if (*self->alive_) self->shared_.tell_error(error);
  });
}

void PcicConnection::stopWaiting() {
  waits_.cancel();
  if (waiting_ticket_) reply(*std::exchange(waiting_ticket_, std::nullopt), toftwin::o3d303::kRefused);
}

void PcicConnection::replyImage(const std::string& ticket, int number) {
  constexpr int kLastResult = 10;
  const auto frame = shared_.hooks.last_frame();
  const Schema wanted =
      number == kLastResult ? withoutMarkers(schema()) : shared_.hooks.schema_of_image(number);
  if (!frame || wanted.empty()) return reply(ticket, toftwin::o3d303::kRefused);
  const auto content = frame(wanted);
  if (!content) return reply(ticket, toftwin::o3d303::kRefused);
  Bytes answer;
  toftwin::o3d303::appendText(answer, fmt::format("{:09}", content->size()));
  answer.insert(answer.end(), content->begin(), content->end());
  replyWith(ticket, answer);
}

void PcicConnection::activate(const std::string& ticket, int index) {
  shared_.hooks.activate(index, [self = shared_from_this(), ticket](bool is_done) {
    self->reply(ticket, is_done ? toftwin::o3d303::kDone : toftwin::o3d303::kRefused);
  });
}

void PcicConnection::wire(const std::string& ticket, const Command& command) {
  if (command.number < 1 || command.number > PcicShared::kWires)
    return reply(ticket, toftwin::o3d303::kRefused);
  bool& is_high = shared_.wires[static_cast<std::size_t>(command.number) - 1];
  if (command.kind == Command::Kind::AskWire)
    return reply(ticket, fmt::format("{:02}{}", command.number, is_high ? 1 : 0));
  is_high = command.is_high;
  reply(ticket, toftwin::o3d303::kDone);
}

/// The answer is of the version in which it was asked.
void PcicConnection::setVersion(const std::string& ticket, int version) {
  if (version < kOldest || version > kNewest) return reply(ticket, toftwin::o3d303::kRefused);
  reply(ticket, toftwin::o3d303::kDone);
  version_ = static_cast<toftwin::o3d303::PcicVersion>(version);
  reader_.setVersion(version_);
}

}  // namespace toftwin::daemon::ifm
