// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace toftwin::wire {

/// CRC-32C (Castagnoli, RFC 3720 §12.1: reflected, initial value and final xor all ones) of `bytes`.
/// With `previous`, of the bytes that gave it followed by `bytes`. Uses the CPU's instruction if
/// there is one.
std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t previous = 0);

/// The same without the CPU's instruction; public so that a test can hold one against the other.
std::uint32_t crc32cPortable(std::span<const std::byte> bytes, std::uint32_t previous = 0);

}  // namespace toftwin::wire
