// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

/// Registers and bytes that both halves of the emulated camera need.
namespace toftwin::test::gige {

using Bytes = std::vector<std::byte>;

inline constexpr std::uint16_t kPort = 3956;
inline constexpr std::uint32_t kXmlAddress = 0x80000;
inline constexpr std::uint32_t kStreamPort = 0xD00, kPacketSize = 0xD04, kStreamAddress = 0xD18,
                               kSourcePort = 0xD1C, kMultipart = 0xD24;
inline constexpr std::uint32_t kMultipartBit = 0x40, kTestBit = 0x80000000;
inline constexpr std::uint16_t kNotImplemented = 0x8001, kInvalidAddress = 0x8003,
                               kAccessDenied = 0x8006;

inline void put(Bytes& bytes, std::uint64_t number, unsigned size) {
  for (; size > 8; --size) bytes.push_back(std::byte{0});
  for (unsigned i = size; i-- > 0;) bytes.push_back(static_cast<std::byte>(number >> (8 * i)));
}
inline std::uint64_t get(std::span<const std::byte> bytes, std::size_t at, std::size_t size) {
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < size && at + i < bytes.size(); ++i)
    number = number << 8U | std::to_integer<std::uint64_t>(bytes[at + i]);
  return number;
}

inline sockaddr_in socketAddress(std::uint32_t address, std::uint16_t port) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(port);
  at.sin_addr.s_addr = htonl(address);
  return at;
}

}  // namespace toftwin::test::gige
