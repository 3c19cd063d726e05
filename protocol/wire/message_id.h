// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <variant>

#include "protocol/wire/messages.h"

namespace toftwin::wire {

/// The request that a message is, or answers; 0: none.
template <class M>
std::uint64_t idOf(const M& message) {
  if constexpr (requires { message.id; }) return message.id;
  return 0;
}
inline std::uint64_t idOf(const Message& message) {
  return std::visit([](const auto& m) { return idOf(m); }, message);
}

}  // namespace toftwin::wire
