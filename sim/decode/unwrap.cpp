// SPDX-License-Identifier: Apache-2.0
#include "sim/decode/unwrap.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>

namespace toftwin::sim {
namespace {

/// The nearest whole number, for |x| < 2⁵¹: what 1.5·2⁵² rounds away. Baseline x86 has no
/// instruction for it.
double nearestWhole(double x) { return (x + 0x1.8p52) - 0x1.8p52; }

/// Distance of the phases (in cycles) from the line through 0 along (10, 2, 15), in radians.
double distanceFromLine(double k80, double k16, double k120) {
  // |k × n|, n the unit vector along (10, 2, 15), 10² + 2² + 15² = 329
  const double x = (k16 * 15.0 - k120 * 2.0);
  const double y = (k120 * 10.0 - k80 * 15.0);
  const double z = (k80 * 2.0 - k16 * 10.0);
  return 2.0 * std::numbers::pi * std::sqrt((x * x + y * y + z * z) / 329.0);
}

}  // namespace

Unwrapped unwrapKinectV2(double cycles_80, double cycles_16, double cycles_120, double unit_m) {
  double units_80 = 3.0 * (cycles_80 + nearestWhole(5.0 * cycles_16 - cycles_80));
  double full_16 = cycles_16;
  const double periods_beside_120 = units_80 / 2.0 - cycles_120;
  if (std::abs(periods_beside_120 - nearestWhole(periods_beside_120)) >
      0.25) {  // the second 15 units
    units_80 += 15.0;
    full_16 += 1.0;
  }
  const double full_80 = units_80 / 3.0;
  const double full_120 = cycles_120 + nearestWhole(units_80 / 2.0 - cycles_120);
  return {.range_m = unit_m * (30.0 / 27.0) * (full_80 + full_16 + full_120),
          .deviation_rad = distanceFromLine(full_80, full_16, full_120)};
}

Unwrapper::Unwrapper(std::span<const Frequency> frequencies, double speed_of_light) {
  std::int64_t common_khz = 0;
  for (std::size_t i = 0; i < frequencies.size(); ++i) {
    const double hz = frequencies[i].in(hertz);
    period_m_.push_back(speed_of_light / (2.0 * hz));
    common_khz = std::gcd(common_khz, static_cast<std::int64_t>(std::llround(hz / 1e3)));
    if (period_m_[i] < period_m_[highest_]) highest_ = i;
  }
  unambiguous_range_m_ = speed_of_light / (2e3 * static_cast<double>(common_khz));
  candidates_ = static_cast<int>(std::lround(unambiguous_range_m_ / period_m_[highest_]));
}

Unwrapped Unwrapper::operator()(std::span<const double> cycles,
                                std::span<const double> amplitudes) const {
  Unwrapped best;
  double smallest_spread = std::numeric_limits<double>::infinity();
  for (int n = 0; n < candidates_; ++n) {
    const double coarse_m = (cycles[highest_] + n) * period_m_[highest_];
    double weights = 0.0, mean_m = 0.0, spread = 0.0, squares = 0.0;
    for (std::size_t i = 0; i < period_m_.size(); ++i) {
      // Weighted mean and spread in one pass (West's update).
      const double range_m =
          (cycles[i] + nearestWhole(coarse_m / period_m_[i] - cycles[i])) * period_m_[i];
      const double weight = std::pow(amplitudes[i] / period_m_[i], 2);
      weights += weight;
      const double step = range_m - mean_m;
      if (weights > 0.0) mean_m += step * weight / weights;
      spread += weight * step * (range_m - mean_m);
    }
    if (spread >= smallest_spread) continue;
    smallest_spread = spread;
    for (std::size_t i = 0; i < period_m_.size(); ++i) {
      const double off_cycles = mean_m / period_m_[i] - cycles[i];
      squares += std::pow(off_cycles - nearestWhole(off_cycles), 2);
    }
    best = {.range_m = mean_m,
            .deviation_rad = 2.0 * std::numbers::pi *
                             std::sqrt(squares / static_cast<double>(period_m_.size()))};
  }
  return best;
}

}  // namespace toftwin::sim
