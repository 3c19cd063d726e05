// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <toftwin/result.h>

#include "drivers/visionary/wire/big_endian.h"

/// CoLa 2, by which a SICK Visionary is set: telegrams over TCP,
///
///   02 02 02 02  length  hub  noc  session  request  command
///
/// with a length of 32 bits of all that follows it, two bytes for routing, 32 bits of session and 16 bits of
/// request number, which the answer repeats. A command is two letters, and for variables and methods " NAME
/// ", then parameters. [SICKAG/sick_visionary_cpp_base 1.1.0]
namespace toftwin::visionary {

struct Telegram {
  std::uint32_t session = 0;
  std::uint16_t request = 0;
  Bytes command;
};
Bytes encode(const Telegram& telegram);

/// Cuts telegrams out of a stream of bytes that arrive in pieces. What stands before four bytes of 2 is
/// passed over.
class TelegramReader {
 public:
  explicit TelegramReader(std::size_t most_bytes) : most_bytes_(most_bytes) {}
  void feed(std::span<const std::byte> bytes);
  /// The next whole one, or nothing until more is fed. TooLarge, Malformed: the stream's order is lost.
  Result<std::optional<Telegram>> next();

 private:
  std::size_t most_bytes_;
  Bytes buffer_;
};

/// Errors as CoLa numbers them.
enum class ColaError : std::uint16_t {
  AccessDenied = 1,  ///< the user level is too low for that method
  UnknownMethod = 2,
  UnknownVariable = 3,
  ConditionFailed = 4,
  InvalidData = 5,
  Unknown = 6,
  TooLong = 7,
  TooShort = 8,
  WriteDenied = 10,  ///< the same for a variable
  UnknownCommand = 12,
  NoSessions = 33,
  UnknownSession = 34
};

/// A command as it was asked.
struct ColaCommand {
  enum class Kind { Open, Close, Read, Write, Call, Other };
  Kind kind = Kind::Other;
  std::string name{};  ///< of the variable or method
  Bytes params{};
};
/// Any bytes are safe.
ColaCommand readCommand(std::span<const std::byte> command);

/// What is asked, as a client says it.
Bytes askedOf(const ColaCommand& command);
/// What is answered to it: the letters of the answer and the name, then what is told.
Bytes answerTo(const ColaCommand& command, std::span<const std::byte> told = {});
Bytes errorAnswer(ColaError error);

/// An answer as a client reads it: what is told, or the error. Malformed: it is none to that command.
struct ColaAnswer {
  std::optional<ColaError> error{};
  Bytes told{};
};
Result<ColaAnswer> readAnswer(std::span<const std::byte> answer, const ColaCommand& asked);

}  // namespace toftwin::visionary
