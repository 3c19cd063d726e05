// SPDX-License-Identifier: Apache-2.0
#include "sim/decode/unwrap.h"

#include <toftwin/modulation.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "sim/decode/unwrap_kinect_v2.h"

namespace toftwin::sim {
Unwrapped unwrapKinectV2(double cycles_80, double cycles_16, double cycles_120, double unit_m) {
  return joinKinectV2(cycles_80, cycles_16, cycles_120, unit_m);
}

Unwrapper::Unwrapper(std::span<const Frequency> frequencies, double speed_of_light) {
  for (std::size_t i = 0; i < frequencies.size(); ++i) {
    period_m_.push_back(speed_of_light / (2.0 * frequencies[i].in(hertz)));
    per_m_.push_back(1.0 / period_m_.back());
    if (period_m_[i] < period_m_[highest_]) highest_ = i;
  }
  unambiguous_range_m_ = speed_of_light / (2.0 * commonFrequency(frequencies).in(hertz));
  candidates_ = static_cast<int>(std::lround(unambiguous_range_m_ / period_m_[highest_]));
}

Unwrapped Unwrapper::operator()(std::span<const double> cycles,
                                std::span<const double> amplitudes) const {
  const std::size_t count = period_m_.size();
  double smallest_spread = std::numeric_limits<double>::infinity(), best_m = 0.0;
  for (int n = 0; n < candidates_; ++n) {
    const double coarse_m = (cycles[highest_] + n) * period_m_[highest_];
    double weights = 0.0, mean_m = 0.0, spread = 0.0;
    // Weighted mean and spread in one pass (West's update); the spread only grows.
    for (std::size_t i = 0; i < count && !(spread >= smallest_spread); ++i) {
      const double range_m = (cycles[i] + nearestWhole(coarse_m * per_m_[i] - cycles[i])) * period_m_[i];
      const double weight = std::pow(amplitudes[i] * per_m_[i], 2);
      weights += weight;
      const double step = range_m - mean_m;
      if (weights > 0.0) mean_m += step * weight / weights;
      spread += weight * step * (range_m - mean_m);
    }
    if (spread >= smallest_spread) continue;
    smallest_spread = spread, best_m = mean_m;
  }
  double squares = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double off_cycles = best_m * per_m_[i] - cycles[i];
    squares += std::pow(off_cycles - nearestWhole(off_cycles), 2);
  }
  return {.range_m = best_m,
          .deviation_rad = 2.0 * std::numbers::pi * std::sqrt(squares / static_cast<double>(count))};
}

}  // namespace toftwin::sim
