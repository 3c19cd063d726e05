// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace toftwin::compare {

/// Larger differences are no measurement error but a wrong one of the phase's periods, or another
/// surface seen at an edge. They are counted, and left out of all but the masks.
inline constexpr double kGross_mm = 300.0;
/// Where the means' noise is more of it, so much of a normal one lies beyond that a cut about 0 shifts the
/// mean.
inline constexpr double kNoisy_mm = kGross_mm / 6.0;
inline bool isGross(double difference_mm) { return std::abs(difference_mm) > kGross_mm; }

/// Where the cut at kGross_mm lies about: 0; or, where the median of `noise_mm`, σ of each difference, is
/// over kNoisy_mm, the mean of what it leaves, so that it takes no more from one side than from the other. 0
/// all the same where that mean is nearer to the cut than to 0, by more than 3 σ/√n: of another surface 450
/// mm away noise brings some pixels within 300 mm of 0, and the cut would go after them.
double middleOfCut_mm(std::span<const double> difference_mm, std::vector<double> noise_mm);

/// σ of a pixel's mean over the valid ones of so many frames. Infinite where none is.
inline double noiseOfMean(double temporal_noise, std::size_t frames, double valid_share) {
  return temporal_noise / std::sqrt(static_cast<double>(frames) * valid_share);
}

}  // namespace toftwin::compare
