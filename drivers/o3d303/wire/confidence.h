// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

/// The camera's confidence byte and our pixel flags, which say the same in other bits.
namespace toftwin::o3d303 {

/// Bits of the confidence image. Only the first decides whether a pixel has a value.
enum class Confidence : std::uint8_t {
  Invalid = 1 << 0,
  Saturated = 1 << 1,
  Asymmetric = 1 << 2,  ///< the two taps contradict each other: motion
  LowAmplitude = 1 << 3,
  Exposure = 3 << 4,  ///< which of the exposures was used: a number, no flag
  Clipped = 1 << 6,   ///< outside of the box or the region that the user set
  Suspect = 1 << 7,   ///< the camera does not say why
};

/// PixelFlag bits. Clipped becomes OutOfRange and Suspect UnwrapUnreliable: what most often makes a
/// range suspect is that it may be a period off. The exposure is no flag.
std::uint8_t flagsOf(std::uint8_t confidence);
/// The other way; flags that the camera does not know are lost (a Mixed pixel is Suspect).
std::uint8_t confidenceOf(std::uint8_t flags);

/// Which exposure a pixel is of, counted from 0, the longest. In the byte 11 is the longest, 10 the shorter
/// of two, 01 the shortest of three, and 00 is not used, and taken as the longest (ifm3d,
/// doc/O3D_confidence.md).
std::uint8_t exposureOf(std::uint8_t confidence);
/// The other way, of the first three.
std::uint8_t confidenceOfExposure(unsigned index);

}  // namespace toftwin::o3d303
