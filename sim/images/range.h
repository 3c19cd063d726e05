// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstdint>
#include <vector>

#include <toftwin/image.h>

namespace toftwin::sim {

/// What decoding gives: range along the ray (NaN where `flags` has PixelFlag::Invalid), amplitude and
/// ambient in electrons, and the demodulated phasor of each frequency.
struct RangeImage {
  Image<float> range_m;
  Image<float> amplitude;
  Image<float> ambient;
  Image<std::uint8_t> flags;
  std::vector<Image<std::complex<float>>> phasors;
  /// Which of several exposures a pixel is of, counted from 0; empty where there is one.
  Image<std::uint8_t> exposure{};
};

}  // namespace toftwin::sim
