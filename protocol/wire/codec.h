// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <toftwin/result.h>

#include "protocol/wire/messages.h"

/// Bytes ⇄ messages. No sockets, threads or clocks. docs/protocol.md is normative.
namespace toftwin::wire {

inline constexpr std::size_t kPreambleSize = 64;
inline constexpr std::size_t kAlignment = 64;

/// The most that a peer may announce; checked before anything is allocated.
struct Limits {
  std::uint32_t header_bytes = 1u << 20;
  std::uint64_t body_bytes = 256ull << 20;
};

/// The fixed first 64 bytes of a message, checked.
struct Preamble {
  std::uint16_t major = kVersionMajor;
  std::uint16_t minor = kVersionMinor;
  std::uint32_t header_bytes = 0;  ///< FlatBuffers header, padded to 64
  std::uint64_t body_bytes = 0;    ///< planes, each padded to 64
  std::uint32_t header_crc32c = 0;
  std::uint32_t body_crc32c = 0;
};
Result<Preamble> decodePreamble(std::span<const std::byte, kPreambleSize> bytes, const Limits& limits);

/// The planes of a frame as they follow the header, with their CRC; encoded once and shared by all
/// subscriptions that want the same planes. Nothing is copied: `pieces` point into the planes and
/// into static zeros for padding.
struct Body {
  std::vector<Buffer> pieces;
  std::uint64_t bytes = 0;
  std::uint32_t crc32c = 0;
};
Body encodeBody(const std::vector<Plane>& planes);

/// A message ready to be written: `head` (preamble and header), then the body's pieces in order.
struct Encoded {
  std::vector<std::byte> head;
  Body body;
  [[nodiscard]] std::uint64_t size() const { return head.size() + body.bytes; }
};
Encoded encode(const Message& message);
/// A frame whose body was encoded before with `encodeBody(frame.planes)`.
Encoded encode(const FrameMessage& message, Body body);
/// The message as one run of bytes: for recordings and tests.
std::vector<std::byte> toBytes(const Encoded& message);

/// A message from its parts. `header` and `body` must have the lengths that the preamble says; both
/// CRCs are checked, the header is verified, every plane must lie in the body. The frame's planes
/// refer to `body` without copying.
Result<Message> decode(const Preamble& preamble, std::span<const std::byte> header, Buffer body);
/// A message from one run of bytes, which must hold exactly one message.
Result<Message> decode(Buffer bytes, const Limits& limits = {});

}  // namespace toftwin::wire
