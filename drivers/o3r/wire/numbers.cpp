// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3r/wire/numbers.h"

#include <algorithm>
#include <cmath>

namespace toftwin::o3r {

float distanceResolution(double longest_range_m) { return static_cast<float>(longest_range_m / kMostCounts); }

std::uint16_t distanceCounts(double range_m, float resolution_m) {
  const double counts = std::round(range_m / static_cast<double>(resolution_m));
  return counts >= 1.0 && counts <= kMostCounts ? static_cast<std::uint16_t>(counts) : std::uint16_t{0};
}

float metresOf(std::uint16_t counts, float resolution_m) { return static_cast<float>(counts) * resolution_m; }

std::uint16_t amplitudeCounts(double amplitude, float resolution) {
  if (!(amplitude >= 0.0)) return 0;
  const double counts = 1.0 + std::round(std::sqrt(amplitude / static_cast<double>(resolution)));
  return static_cast<std::uint16_t>(std::min(counts, kMostCounts));
}

float amplitudeOf(std::uint16_t counts, float resolution) {
  const float root = static_cast<float>(counts) - 1.0F;
  return root >= 0.0F ? root * root * resolution : -1.0F;
}

}  // namespace toftwin::o3r
