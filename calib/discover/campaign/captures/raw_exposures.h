// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/image.h>

#include "sim/images/samples.h"

namespace toftwin::discover {

/// What the raw exposures of one frame say before anything is decoded. Of one frequency f with K samples s_k, k/K of a
/// period apart, the wave is z = (2/K) Σ s_k e^(−2πik/K) and its range −arg z · c/4πf, to a period. What of the samples
/// no such wave makes, over |z|, is a closure: their mean, and the Fourier series' parts beyond the first. Noise of the
/// samples, where it is alike in all, is independent in z and in each of them.
struct RawReading {
  Image<float> range_m;    ///< of the highest frequency, between 0 and a period; NaN where a sample is missing
  double period_m = 0.0;   ///< c/2f
  /// K − 2 a frequency, of which the first is the mean: of samples that are no differences of two taps it is the light
  /// that is not modulated, and no closure.
  std::vector<Image<float>> closures{};
  std::size_t per_frequency = 0;
};

/// From a frame's plane of samples; nothing where it has none, or does not say the exposures' frequencies.
std::optional<RawReading> rawReadingOf(const Frame& frame);
RawReading rawReadingOf(const sim::Samples& samples);

/// The same range to a period: the one nearest to `about`.
float nearestRange(float range_m, float about_m, double period_m);

}  // namespace toftwin::discover
