// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace toftwin::test {

inline void putLittle(std::vector<std::byte>& bytes, std::uint64_t number, unsigned size) {
  for (unsigned i = 0; i < size; ++i) bytes.push_back(static_cast<std::byte>(number >> (8 * i)));
}
/// What is beyond the end is zero.
inline std::uint64_t getLittle(std::span<const std::byte> bytes, std::size_t at, std::size_t size) {
  std::uint64_t number = 0;
  for (std::size_t i = size; i-- > 0;)
    number = number << 8U | (at + i < bytes.size() ? std::to_integer<std::uint64_t>(bytes[at + i]) : 0U);
  return number;
}

}  // namespace toftwin::test
