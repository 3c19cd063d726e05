// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <span>

#include <toftwin/frame.h>

namespace toftwin::sim {

// What the Kinect v2's decoder does with each pixel by itself, row by row, as loops that become vector code.

/// What it holds against a pixel, and what it measures with.
struct KinectLimits {
  std::array<double, 3> counts_per_electron;  ///< of each frequency's amplitude
  double least_counts, least_sum_counts;
  double unit_m;                 ///< unwrapKinectV2()
  double strong_rad, weak_rad;   ///< thresholds of phases that disagree: of strong signals, of weak ones
  double nearest_m, farthest_m;  ///< of depth
  double baseline_m, baseline_square;  ///< rangeOfWay(); the square is 0 where the device drops it
};

/// One row of what decoding found: phases in cycles and amplitudes in electrons by frequency, and the pixels'
/// rays.
struct KinectSeen {
  std::array<const float*, 3> cycles, amplitudes;
  const float *ray_x, *ray_z;
};

/// One row of what it makes of that.
struct KinectFound {
  float *range_m, *brightness;  ///< the latter the sum of the amplitudes in counts
  double *deviation_rad, *strongest_counts;
  std::uint32_t* why;  ///< PixelFlag bits, and kDoubtful
};

/// Why a pixel is invalid whose phases disagree.
inline constexpr auto kUnreliable =
    static_cast<std::uint32_t>(PixelFlag::UnwrapUnreliable) | static_cast<std::uint32_t>(PixelFlag::Invalid);
/// Phases that disagree by so nearly as much as they may that kinectV2Threshold() decides.
inline constexpr std::uint32_t kDoubtful = 0x100;

/// Between those of strong and of weak signals the threshold is a power of the strongest frequency's counts:
/// its logarithm is kThresholdSlope · ln counts + kThresholdLevel. In libfreenect2 it is
/// (ln counts · −0.5330578 · log₁₀2 + 0.7694894) · log₂10.
inline constexpr double kThresholdSlope = -0.5330578 * 0.301030 * 3.321928, kThresholdLevel = 0.7694894 * 3.321928;

/// Unwraps and judges a row. True if a pixel is doubtful.
bool measureKinectRow(const KinectSeen& seen, const KinectLimits& limits, std::size_t width,
                      const KinectFound& found);

/// A row's flags from those before decoding (none: null) and from what decoding found; ranges of invalid
/// pixels become NaN.
void judgeRow(const std::uint8_t* before, const std::uint32_t* why, std::size_t width, float* range_m,
              std::uint8_t* flags);

/// Marks the pixels whose neighbours are unlike them.
void markEdges(std::span<const float> unlikeness, float most, std::span<std::uint8_t> is_edge);

/// mean += `share` · |p| for a row of phasors.
void addAmplitudes(const std::complex<float>* phasors, float share, std::size_t width, float* mean);

}  // namespace toftwin::sim
