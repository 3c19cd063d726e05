// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <numeric>
#include <ranges>

#include <toftwin/units.h>

namespace toftwin {

/// The highest frequency that all of those are multiples of, each taken to whole kilohertz; 0 Hz without any.
/// Phases at several frequencies repeat together after the range after which a phase at this one does.
template <std::ranges::input_range Modulations, class Projection = std::identity>
constexpr Frequency commonFrequency(const Modulations& modulations, Projection projection = {}) {
  std::int64_t common_khz = 0;
  for (const auto& one : modulations) {
    const Frequency modulation = std::invoke(projection, one);
    common_khz = std::gcd(common_khz, static_cast<std::int64_t>(1e-3 * modulation.in(hertz) + 0.5));
  }
  return Frequency{1e3 * static_cast<double>(common_khz), hertz};
}

}  // namespace toftwin
