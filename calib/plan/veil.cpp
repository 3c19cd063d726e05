// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/veil.h"

#include <cmath>
#include <numbers>

#include <toftwin/units.h>

namespace toftwin::plan {

Veil::Veil(const Image<float>& range_m, const Image<float>& amplitude, std::span<const double> frequency_hz) {
  for (const double f : frequency_hz) {
    const double radians_per_m = 4.0 * std::numbers::pi * f / kSpeedOfLight_m_per_s;
    std::complex<double> sum = 0.0;
    for (std::size_t i = 0; i < amplitude.size(); ++i) {
      if (std::isfinite(range_m[i]) && std::isfinite(amplitude[i]))
        sum +=
            std::polar(static_cast<double>(amplitude[i]), -radians_per_m * static_cast<double>(range_m[i]));
    }
    radians_per_m_.push_back(radians_per_m);
    light_.push_back(amplitude.empty() ? 0.0 : sum / static_cast<double>(amplitude.size()));
  }
}

std::vector<double> Veil::slopes_mm(double range_m, double amplitude) const {
  std::vector<double> slopes;
  for (std::size_t f = 0; f < light_.size(); ++f) {
    const std::complex<double> over_own =
        light_[f] * std::polar(1.0, radians_per_m_[f] * range_m) / amplitude;
    slopes.push_back(-1e3 * over_own.imag() / radians_per_m_[f]);
  }
  return slopes;
}

}  // namespace toftwin::plan
