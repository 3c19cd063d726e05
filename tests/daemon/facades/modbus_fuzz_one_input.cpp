// SPDX-License-Identifier: Apache-2.0
// A stream of Modbus TCP messages, cut as the server cuts it.
#include <cstdlib>

#include "daemon/facades/modbus/identification.h"
#include "daemon/facades/modbus/requests.h"
#include "fuzz_one_input.h"

namespace toftwin::daemon {
namespace {

void demand(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

void fuzzOneInput(std::span<const std::byte> bytes) {
  using namespace modbus;
  Registers registers;
  for (const Row& row : registerMap()) registers.set(row.item, 1.0);
  const TakeWrite take = [&](const Write& write) {
    demand(!write.words.empty());
    for (std::size_t i = 0; i < write.words.size(); ++i) {
      demand(registers.isWritable(write.memory, write.address + i));
      registers.write(write.memory, write.address + i, write.words[i]);
    }
    return write.words.front() == 7 ? Exception::kBusy : std::uint8_t{0};
  };
  while (true) {
    const auto size = messageSize(bytes);
    if (!size || *size == 0 || bytes.size() < *size) return;
    const Bytes made = answer(bytes.first(*size), registers, take, Identity{});
    const auto answered =
        messageSize(made);  // an answer is a message, too, and goes into one of the largest size
    demand(answered && *answered == made.size() && made.size() <= 260);
    demand(made[0] == bytes[0] && made[1] == bytes[1] && made[6] == bytes[6]);
    bytes = bytes.subspan(*size);
  }
}

}  // namespace toftwin::daemon
