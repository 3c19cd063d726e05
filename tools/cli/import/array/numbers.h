// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <toftwin/frame.h>

namespace toftwin::cli {

/// How numbers lie in bytes, as NumPy says it: "<f4", "u2", ">i2", "|u1".
struct NumberType {
  char kind = 'f';  ///< f: floats, u: counts, i: counts with a sign
  std::size_t size = 4;
  bool is_swapped = false;
};
/// Nothing for what is none of f4, f8, u1, u2, u4, i1, i2 and i4. Without a mark the little end comes first.
std::optional<NumberType> numberTypeNamed(std::string_view name);

/// So many numbers as a plane. Distances become metres: counts of `mm_per_count`, and floats as they are; 0 and less, the
/// largest count of a type and what is not finite become NaN. Other kinds stay numbers: u1 and u2 as they are, the others floats.
Plane planeOfNumbers(std::span<const std::byte> bytes, const NumberType& type, int width, int height, PlaneKind kind, double mm_per_count);

}  // namespace toftwin::cli
