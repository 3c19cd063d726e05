// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/modbus/requests.h"

#include <algorithm>

#include "daemon/facades/modbus/identification.h"

namespace toftwin::daemon::modbus {
namespace {

// The header: transaction, protocol (0), length of what follows, unit; then function and data.
constexpr std::size_t kLength = 4, kUnit = 6, kFunction = 7, kData = 8;
constexpr std::size_t kLeastLength = 2, kMostLength = 254;
constexpr std::size_t kMostBitsRead = 2000, kMostWordsRead = 125, kMostBitsWritten = 1968,
                      kMostWordsWritten = 123;
constexpr std::uint16_t kOn = 0xFF00, kOff = 0x0000;

std::uint8_t byteAt(std::span<const std::byte> bytes, std::size_t at) {
  return std::to_integer<std::uint8_t>(bytes[at]);
}
std::uint16_t wordAt(std::span<const std::byte> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(byteAt(bytes, at) << 8 | byteAt(bytes, at + 1));
}
void append(Bytes& bytes, std::uint16_t word) {
  bytes.push_back(static_cast<std::byte>(word >> 8));
  bytes.push_back(static_cast<std::byte>(word & 0xFF));
}

/// What comes after the function in an answer, or an exception.
struct Reply {
  Bytes data{};
  std::uint8_t exception = 0;
};
Reply refuse(std::uint8_t exception) { return {{}, exception}; }

Reply read(const Registers& registers, Memory memory, std::span<const std::byte> data) {
  const bool is_bits = memory == Memory::Coil || memory == Memory::Discrete;
  if (data.size() != 4) return refuse(Exception::kValue);
  const std::size_t first = wordAt(data, 0), count = wordAt(data, 2);
  if (count == 0 || count > (is_bits ? kMostBitsRead : kMostWordsRead)) return refuse(Exception::kValue);
  if (first + count > registers.size(memory)) return refuse(Exception::kAddress);
  Reply reply;
  reply.data.push_back(static_cast<std::byte>(is_bits ? (count + 7) / 8 : 2 * count));
  if (is_bits) reply.data.resize(1 + (count + 7) / 8);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint16_t word = registers.at(memory, first + i);
    if (!is_bits) {
      append(reply.data, word);
    } else if (word != 0) {
      reply.data[1 + i / 8] |= static_cast<std::byte>(1U << (i % 8));
    }
  }
  return reply;
}

Reply taken(const Registers& registers, const TakeWrite& take, const Write& write,
            std::span<const std::byte> echo) {
  for (std::size_t i = 0; i < write.words.size(); ++i) {
    if (!registers.isWritable(write.memory, write.address + i)) return refuse(Exception::kAddress);
  }
  if (const std::uint8_t exception = take(write); exception != 0) return refuse(exception);
  return {Bytes(echo.begin(), echo.end()), 0};
}

Reply writeOne(const Registers& registers, const TakeWrite& take, Memory memory,
               std::span<const std::byte> data) {
  if (data.size() != 4) return refuse(Exception::kValue);
  std::uint16_t value = wordAt(data, 2);
  if (memory == Memory::Coil) {
    if (value != kOn && value != kOff) return refuse(Exception::kValue);
    value = value == kOn ? 1 : 0;
  }
  return taken(registers, take, {memory, wordAt(data, 0), {value}}, data);
}

Reply writeMany(const Registers& registers, const TakeWrite& take, Memory memory,
                std::span<const std::byte> data) {
  const bool is_bits = memory == Memory::Coil;
  if (data.size() < 5) return refuse(Exception::kValue);
  const std::size_t count = wordAt(data, 2), bytes = byteAt(data, 4);
  if (count == 0 || count > (is_bits ? kMostBitsWritten : kMostWordsWritten) ||
      bytes != (is_bits ? (count + 7) / 8 : 2 * count) || data.size() != 5 + bytes) {
    return refuse(Exception::kValue);
  }
  Write write{memory, wordAt(data, 0), {}};
  for (std::size_t i = 0; i < count; ++i) {
    write.words.push_back(is_bits ? static_cast<std::uint16_t>(byteAt(data, 5 + i / 8) >> (i % 8) & 1U)
                                  : wordAt(data, 5 + 2 * i));
  }
  return taken(registers, take, write, data.first(4));
}

/// Function 23: what to read, what to write, and the words, which are written first.
Reply writeAndRead(const Registers& registers, const TakeWrite& take, std::span<const std::byte> data) {
  constexpr std::size_t kWhatToRead = 4, kMostWords = 121;
  if (data.size() < kWhatToRead + 5) return refuse(Exception::kValue);
  const auto to_read = data.first(kWhatToRead), to_write = data.subspan(kWhatToRead);
  if (wordAt(to_write, 2) > kMostWords) return refuse(Exception::kValue);
  // What cannot be read must not have been written.
  if (Reply unread = read(registers, Memory::Holding, to_read); unread.exception != 0) return unread;
  if (Reply written = writeMany(registers, take, Memory::Holding, to_write); written.exception != 0)
    return written;
  return read(registers, Memory::Holding, to_read);
}

Reply identify(std::span<const std::byte> data, const Identity& identity) {
  auto [bytes, exception] = identificationFor(data, identity);
  return {std::move(bytes), exception};
}

Reply reply(const Registers& registers, const TakeWrite& take, const Identity& identity,
            std::uint8_t function, std::span<const std::byte> data) {
  switch (function) {
    case 1:
      return read(registers, Memory::Coil, data);
    case 2:
      return read(registers, Memory::Discrete, data);
    case 3:
      return read(registers, Memory::Holding, data);
    case 4:
      return read(registers, Memory::Input, data);
    case 5:
      return writeOne(registers, take, Memory::Coil, data);
    case 6:
      return writeOne(registers, take, Memory::Holding, data);
    case 15:
      return writeMany(registers, take, Memory::Coil, data);
    case 16:
      return writeMany(registers, take, Memory::Holding, data);
    case 23:
      return writeAndRead(registers, take, data);
    case 43:
      return identify(data, identity);
    default:
      return refuse(Exception::kFunction);
  }
}

}  // namespace

std::optional<std::size_t> messageSize(std::span<const std::byte> bytes) {
  if (bytes.size() < kUnit) return std::nullopt;
  const std::size_t length = wordAt(bytes, kLength);
  if (wordAt(bytes, 2) != 0 || length < kLeastLength || length > kMostLength) return std::size_t{0};
  return kUnit + length;
}

Bytes answer(std::span<const std::byte> message, const Registers& registers, const TakeWrite& take,
             const Identity& identity) {
  const std::uint8_t function = byteAt(message, kFunction);
  const Reply made = reply(registers, take, identity, function, message.subspan(kData));
  Bytes bytes(message.begin(), message.begin() + kLength);  // transaction and protocol
  const std::size_t data = made.exception != 0 ? 1 : made.data.size();
  append(bytes, static_cast<std::uint16_t>(2 + data));
  bytes.push_back(message[kUnit]);
  constexpr std::uint8_t kIsException = 0x80;
  bytes.push_back(static_cast<std::byte>(made.exception != 0 ? function | kIsException : function));
  if (made.exception != 0) bytes.push_back(static_cast<std::byte>(made.exception));
  bytes.insert(bytes.end(), made.data.begin(), made.data.end());
  return bytes;
}

}  // namespace toftwin::daemon::modbus
