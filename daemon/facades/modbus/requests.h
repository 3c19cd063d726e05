// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "daemon/facades/modbus/registers.h"

/// Modbus TCP's messages (Modbus Application Protocol 1.1b3, Messaging on TCP/IP 1.0b): no sockets here.
namespace toftwin::daemon::modbus {

using Bytes = std::vector<std::byte>;
struct Identity;  // identification.h

struct Exception {
  static constexpr std::uint8_t kFunction = 1, kAddress = 2, kValue = 3, kFailure = 4, kBusy = 6;
};

/// What a request writes: words (bits as 0 and 1) from an address on.
struct Write {
  Memory memory = Memory::Holding;
  std::size_t address = 0;
  std::vector<std::uint16_t> words;
};
/// Takes a write to addresses that are all writable, or gives the exception to answer with; 0: taken.
using TakeWrite = std::function<std::uint8_t(const Write&)>;

/// The size of the message that begins with these bytes: nothing if there are too few to tell, 0 if it is
/// none.
std::optional<std::size_t> messageSize(std::span<const std::byte> bytes);
/// The answer to a whole message of that size. Any bytes are safe.
Bytes answer(std::span<const std::byte> message, const Registers& registers, const TakeWrite& take,
             const Identity& identity);

}  // namespace toftwin::daemon::modbus
