// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

/// The head's confidence, 16 bits a pixel, and our pixel flags.
namespace toftwin::o3r {

/// Only the first decides whether a pixel has a value. Bits 4 and 5 are the exposure, as in an O3D303
/// (drivers/o3d303/wire/confidence.h). The last three are from memory of the maker's manual.
enum class Confidence : std::uint16_t {
  Invalid = 1 << 0,
  Saturated = 1 << 1,
  Asymmetric = 1 << 2,  ///< bad symmetry: motion
  LowAmplitude = 1 << 3,
  OutOfRange = 1 << 6,
  Edge = 1 << 7,        ///< a mixed pixel
  Implausible = 1 << 8  ///< the range may be a period off
};

std::uint8_t flagsOf(std::uint16_t confidence);
/// The other way; Interpolated, which the head does not have, is lost.
std::uint16_t confidenceOf(std::uint8_t flags);

}  // namespace toftwin::o3r
