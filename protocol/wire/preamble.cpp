// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstring>
#include <string>

#include "protocol/wire/codec.h"
#include "protocol/wire/crc32c.h"

namespace toftwin::wire {
namespace {

// Where each field lies; docs/protocol.md, "Preamble". All little endian.
constexpr std::size_t kMajorAt = 8;
constexpr std::size_t kMinorAt = 10;
constexpr std::size_t kHeaderBytesAt = 12;
constexpr std::size_t kBodyBytesAt = 16;
constexpr std::size_t kHeaderCrcAt = 24;
constexpr std::size_t kBodyCrcAt = 28;
constexpr std::size_t kBodyPlaceAt = 32;
constexpr std::size_t kReservedAt = 36;
constexpr std::size_t kPreambleCrcAt = 60;

template <class T>
T load(std::span<const std::byte, kPreambleSize> bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

template <class T>
void store(std::span<std::byte, kPreambleSize> bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

Error malformedPreamble(std::string what) {
  return {Error::Code::Malformed, "not a toftwin message: " + std::move(what)};
}

Error tooLarge(const char* part, std::uint64_t announced, std::uint64_t limit) {
  return {Error::Code::TooLarge,
          std::string{"the peer announces a "} + part + " of " + std::to_string(announced) +
              " bytes, the limit here is " + std::to_string(limit) +
              ": ask for fewer planes or a smaller region, or raise the limit"};
}

}  // namespace

std::array<std::byte, kPreambleSize> encodePreamble(const Preamble& preamble) {
  std::array<std::byte, kPreambleSize> bytes{};
  std::memcpy(bytes.data(), kMagic.data(), kMagic.size());
  store(bytes, kMajorAt, preamble.major);
  store(bytes, kMinorAt, preamble.minor);
  store(bytes, kHeaderBytesAt, preamble.header_bytes);
  store(bytes, kBodyBytesAt, preamble.body_bytes);
  store(bytes, kHeaderCrcAt, preamble.header_crc32c);
  store(bytes, kBodyCrcAt, preamble.body_crc32c);
  store(bytes, kBodyPlaceAt, static_cast<std::uint32_t>(preamble.body_place));
  store(bytes, kPreambleCrcAt, crc32c(std::span{bytes}.first<kPreambleCrcAt>()));
  return bytes;
}

Result<Preamble> decodePreamble(std::span<const std::byte, kPreambleSize> bytes,
                                const Limits& limits) {
  if (std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0) {
    return malformedPreamble("the magic is missing; is the other side a toftwin program?");
  }
  Preamble preamble;
  preamble.major = load<std::uint16_t>(bytes, kMajorAt);
  preamble.minor = load<std::uint16_t>(bytes, kMinorAt);
  if (preamble.major != kVersionMajor) {  // first: another version may lay out the rest differently
    return Error{Error::Code::Incompatible,
                 "the peer speaks protocol version " + std::to_string(preamble.major) + "." +
                     std::to_string(preamble.minor) + ", this side " +
                     std::to_string(kVersionMajor) + ".x: update the older of the two"};
  }
  if (load<std::uint32_t>(bytes, kPreambleCrcAt) != crc32c(bytes.first<kPreambleCrcAt>())) {
    return malformedPreamble("the preamble's checksum is wrong");
  }
  preamble.header_bytes = load<std::uint32_t>(bytes, kHeaderBytesAt);
  preamble.body_bytes = load<std::uint64_t>(bytes, kBodyBytesAt);
  preamble.header_crc32c = load<std::uint32_t>(bytes, kHeaderCrcAt);
  preamble.body_crc32c = load<std::uint32_t>(bytes, kBodyCrcAt);
  const auto place = load<std::uint32_t>(bytes, kBodyPlaceAt);
  if (place > static_cast<std::uint32_t>(BodyPlace::Memfd)) {
    return malformedPreamble("the body's place is " + std::to_string(place) + ", which is not known");
  }
  preamble.body_place = static_cast<BodyPlace>(place);
  const auto reserved = bytes.subspan(kReservedAt, kPreambleCrcAt - kReservedAt);
  if (std::ranges::any_of(reserved, [](std::byte b) { return b != std::byte{0}; })) {
    return malformedPreamble("a reserved byte of the preamble is not zero");
  }
  if (preamble.header_bytes == 0 || preamble.header_bytes % kAlignment != 0) {
    return malformedPreamble("a header of " + std::to_string(preamble.header_bytes) +
                             " bytes is not a multiple of 64 above 0");
  }
  if (preamble.body_bytes % kAlignment != 0) {
    return malformedPreamble("a body of " + std::to_string(preamble.body_bytes) +
                             " bytes is not a multiple of 64");
  }
  if (preamble.header_bytes > limits.header_bytes) {
    return tooLarge("header", preamble.header_bytes, limits.header_bytes);
  }
  if (preamble.body_bytes > limits.body_bytes) {
    return tooLarge("body", preamble.body_bytes, limits.body_bytes);
  }
  return preamble;
}

void setBodyPlace(Encoded& message, BodyPlace place) {
  const std::span<std::byte, kPreambleSize> preamble{message.head.data(), kPreambleSize};
  store(preamble, kBodyPlaceAt, static_cast<std::uint32_t>(place));
  store(preamble, kPreambleCrcAt, crc32c(preamble.first<kPreambleCrcAt>()));
}

}  // namespace toftwin::wire
