// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
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

inline constexpr std::string_view kMagic{"TOFTWIN\0", 8};

/// Where a message's body is. On the wire as four bytes.
enum class BodyPlace : std::uint32_t {
  Inline = 0,  ///< right after the header
  Memfd = 1,   ///< in a sealed memfd that comes with the preamble; Unix sockets only, if agreed on
};

/// The fixed first 64 bytes of a message, checked.
struct Preamble {
  std::uint16_t major = kVersionMajor;
  std::uint16_t minor = kVersionMinor;
  std::uint32_t header_bytes = 0;  ///< FlatBuffers header, padded to 64
  std::uint64_t body_bytes = 0;    ///< planes, each padded to 64
  std::uint32_t header_crc32c = 0;
  std::uint32_t body_crc32c = 0;
  BodyPlace body_place = BodyPlace::Inline;
};
std::array<std::byte, kPreambleSize> encodePreamble(const Preamble& preamble);
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
/// The two halves of that: the pieces, which takes no time, and the CRC of all of them.
Body layOutBody(const std::vector<Plane>& planes);
std::uint32_t crc32cOf(const Body& body);

/// A message ready to be written: `head` (preamble and header), then the body's pieces in order.
struct Encoded {
  std::vector<std::byte> head;
  Body body;
  [[nodiscard]] std::uint64_t size() const { return head.size() + body.bytes; }
};
/// Error, naming the field: a value that `decode` would refuse (not finite, out of bounds, a plane whose
/// bytes are not its pixels), or TooLarge: beyond the default Limits, under which a peer can decode whatever
/// was encoded. Only texts for people (an error's message, a detail) are cut to what the protocol allows.
Result<Encoded> encode(const Message& message);
/// A frame whose body was encoded before with `encodeBody(frame.planes)`.
Result<Encoded> encode(const FrameMessage& message, Body body);
/// Says in the preamble that the body does not follow but lies in a memfd.
void setBodyPlace(Encoded& message, BodyPlace place);
/// The message as one run of bytes: for recordings and tests.
std::vector<std::byte> toBytes(const Encoded& message);

/// A message from its parts. `header` and `body` must have the lengths that the preamble says; both
/// CRCs are checked (the body's only when it came inline: a sealed memfd cannot have been damaged on
/// its way), the header is verified, every plane must lie in the body. The frame's planes refer to
/// `body` without copying, unless `body` is not aligned to 64 bytes. Error Unsupported: well formed,
/// but of a kind that this side does not know; the stream is intact behind it.
Result<Message> decode(const Preamble& preamble, std::span<const std::byte> header, Buffer body);
/// The same with the body's CRC as the receiver computed it while the bytes arrived, when they were
/// still in the CPU's caches.
Result<Message> decode(const Preamble& preamble, std::span<const std::byte> header, Buffer body,
                       std::uint32_t body_crc32c);
/// A message from one run of bytes, which must hold exactly one message.
Result<Message> decode(Buffer bytes, const Limits& limits = {});
/// The request id in a header whose CRC was checked, to answer a message that `decode` refused; 0 if
/// the header is damaged too.
std::uint64_t requestIdOf(std::span<const std::byte> header);

/// Memory that begins at a multiple of 64, not initialised.
struct AlignedBytes {
  std::shared_ptr<std::byte[]> bytes;  // shared with the Buffers that refer to it
  std::size_t size = 0;
  [[nodiscard]] std::span<std::byte> span() const { return {bytes.get(), size}; }
  [[nodiscard]] Buffer buffer() const { return {bytes, {bytes.get(), size}}; }
};
AlignedBytes allocateAligned(std::size_t size);

}  // namespace toftwin::wire
