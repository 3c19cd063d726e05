// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

/// Numbers and texts of CoLa 2, most significant byte first.
namespace toftwin::visionary {

using Bytes = std::vector<std::byte>;

template <std::size_t Size>
using UnsignedOf =
    std::conditional_t<Size == 1, std::uint8_t,
                       std::conditional_t<Size == 2, std::uint16_t,
                                          std::conditional_t<Size == 4, std::uint32_t, std::uint64_t>>>;

inline std::string_view textOf(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Makes the parameters of a command, one after another.
class Writer {
 public:
  template <class Number>
  requires std::is_arithmetic_v<Number> Writer& number(Number value) {
    const auto bits = std::bit_cast<UnsignedOf<sizeof(Number)>>(value);
    for (std::size_t i = sizeof(Number); i-- > 0;)
      bytes_.push_back(static_cast<std::byte>((std::uint64_t{bits} >> (8 * i)) & 0xFFU));
    return *this;
  }
  Writer& flag(bool value) { return number(static_cast<std::uint8_t>(value ? 1 : 0)); }
  /// Its length in 16 bits, then the text: CoLa's FlexString.
  Writer& text(std::string_view value) {
    number(static_cast<std::uint16_t>(value.size()));
    return raw(std::as_bytes(std::span{value}));
  }
  Writer& raw(std::span<const std::byte> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_;
};

/// Takes them apart again. After something that is not there, everything is nothing.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <class Number>
  requires std::is_arithmetic_v<Number> std::optional<Number> number() {
    const auto part = raw(sizeof(Number));
    if (!part) return std::nullopt;
    std::uint64_t bits = 0;
    for (const std::byte one : *part) bits = bits << 8 | std::to_integer<std::uint64_t>(one);
    return std::bit_cast<Number>(static_cast<UnsignedOf<sizeof(Number)>>(bits));
  }
  std::optional<std::string> text() {
    const auto size = number<std::uint16_t>();
    const auto part = size ? raw(*size) : std::nullopt;
    return part ? std::optional<std::string>{textOf(*part)} : std::nullopt;
  }
  std::optional<std::span<const std::byte>> raw(std::size_t size) {
    if (size > bytes_.size()) {
      bytes_ = {};
      return std::nullopt;
    }
    const auto part = bytes_.first(size);
    bytes_ = bytes_.subspan(size);
    return part;
  }
  [[nodiscard]] std::span<const std::byte> rest() const { return bytes_; }

 private:
  std::span<const std::byte> bytes_;
};

}  // namespace toftwin::visionary
