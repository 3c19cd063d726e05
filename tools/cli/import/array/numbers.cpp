// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/import/array/numbers.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include <toftwin/nan.h>

#include "tools/cli/import/import_source.h"

namespace toftwin::cli {
namespace {

template <class Number>
Number numberAt(const std::byte* from, bool is_swapped) {
  std::array<std::byte, sizeof(Number)> raw{};
  std::memcpy(raw.data(), from, sizeof(Number));
  if (is_swapped) std::ranges::reverse(raw);
  return std::bit_cast<Number>(raw);
}

template <class Number>
Plane floatsOf(std::span<const std::byte> bytes, bool is_swapped, int width, int height, PlaneKind kind, double mm_per_count) {
  Image<float> image = Image<float>::unset(width, height);
  const double metres = std::is_integral_v<Number> ? mm_per_count * 1e-3 : 1.0;
  for (std::size_t i = 0; i < image.size(); ++i) {
    const auto number = numberAt<Number>(bytes.data() + i * sizeof(Number), is_swapped);
    const auto value = static_cast<double>(number);
    if (!isDistance(kind)) {
      image[i] = static_cast<float>(value);
      continue;
    }
    const bool is_full = std::is_integral_v<Number> && number == std::numeric_limits<Number>::max();
    image[i] = value > 0.0 && std::isfinite(value) && !is_full ? static_cast<float>(value * metres) : kNaN;
  }
  return toPlane(kind, std::move(image));
}

template <class Number>
Plane countsOf(std::span<const std::byte> bytes, bool is_swapped, int width, int height, PlaneKind kind) {
  Image<Number> image = Image<Number>::unset(width, height);
  for (std::size_t i = 0; i < image.size(); ++i) image[i] = numberAt<Number>(bytes.data() + i * sizeof(Number), is_swapped);
  return toPlane(kind, std::move(image));
}

}  // namespace

std::optional<NumberType> numberTypeNamed(std::string_view name) {
  NumberType type;
  if (!name.empty() && std::string_view{"<>|="}.find(name[0]) != std::string_view::npos) {
    type.is_swapped = name[0] == '>';
    name.remove_prefix(1);
  }
  if (name.size() != 2 || std::string_view{"fui"}.find(name[0]) == std::string_view::npos) return std::nullopt;
  type.kind = name[0];
  type.size = static_cast<std::size_t>(name[1] - '0');
  const bool is_float = type.kind == 'f' && (type.size == 4 || type.size == 8);
  const bool is_count = type.kind != 'f' && (type.size == 1 || type.size == 2 || type.size == 4);
  return is_float || is_count ? std::optional{type} : std::nullopt;
}

Plane planeOfNumbers(std::span<const std::byte> bytes, const NumberType& type, int width, int height, PlaneKind kind, double mm_per_count) {
  const bool swap = type.is_swapped;
  if (!isDistance(kind) && type.kind == 'u' && type.size == 1) return countsOf<std::uint8_t>(bytes, swap, width, height, kind);
  if (!isDistance(kind) && type.kind == 'u' && type.size == 2) return countsOf<std::uint16_t>(bytes, swap, width, height, kind);
  const auto floats = [&]<class Number>(Number) { return floatsOf<Number>(bytes, swap, width, height, kind, mm_per_count); };
  if (type.kind == 'f') return type.size == 4 ? floats(float{}) : floats(double{});
  if (type.kind == 'u') return type.size == 1 ? floats(std::uint8_t{}) : type.size == 2 ? floats(std::uint16_t{}) : floats(std::uint32_t{});
  return type.size == 1 ? floats(std::int8_t{}) : type.size == 2 ? floats(std::int16_t{}) : floats(std::int32_t{});
}

}  // namespace toftwin::cli
