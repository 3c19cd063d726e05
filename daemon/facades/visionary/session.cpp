// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/visionary/session.h"

#include <algorithm>

namespace toftwin::daemon::visionary {
namespace {

using toftwin::visionary::Telegram;

Telegram replyTo(const Telegram& asked, Bytes answer) {
  return {.session = asked.session, .request = asked.request, .command = std::move(answer)};
}

}  // namespace

Session::Wanted Session::open(const Telegram& telegram, const ColaCommand& command, SteadyTime now) {
  const auto seconds = toftwin::visionary::Reader{command.params}.number<std::uint8_t>();
  if (!seconds) return replyTo(telegram, errorAnswer(ColaError::TooShort));
  timeout_ = std::chrono::seconds{std::max<int>(*seconds, 1)};
  last_ = now;
  client_ = {};
  Telegram reply = replyTo(telegram, answerTo(command));
  reply.session = number_;
  return reply;
}

Session::Wanted Session::take(const Telegram& telegram, SteadyTime now) {
  ColaCommand command = toftwin::visionary::readCommand(telegram.command);
  if (command.kind == ColaCommand::Kind::Open) return open(telegram, command, now);
  if (timeout_ && now - last_ > *timeout_) {
    timeout_.reset();
    client_ = {};
  }
  if (!timeout_ || telegram.session != number_)
    return replyTo(telegram, errorAnswer(ColaError::UnknownSession));
  last_ = now;
  if (command.kind == ColaCommand::Kind::Other)
    return replyTo(telegram, errorAnswer(ColaError::UnknownCommand));
  if (command.kind != ColaCommand::Kind::Close) return command;
  timeout_.reset();
  client_ = {};
  return replyTo(telegram, answerTo(command));
}

}  // namespace toftwin::daemon::visionary
