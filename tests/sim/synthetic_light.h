// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <vector>

#include "sim/images/light.h"

namespace toftwin::sim {

/// One way the light takes to a pixel: there and back over `range_m`.
struct Way {
  double radiance;
  double range_m;
};

/// Light made by hand instead of traced: each pixel's ways added up as Light defines it.
inline Light syntheticLight(int width, int height, std::vector<Frequency> frequencies,
                            int harmonics, const std::function<std::vector<Way>(int, int)>& waysOf,
                            double ambient = 0.0) {
  Light light;
  light.frequencies = std::move(frequencies);
  light.harmonics = harmonics;
  light.phasors.assign(light.frequencies.size() * static_cast<std::size_t>(harmonics),
                       {width, height});
  light.steady = {width, height};
  light.ambient = {width, height, static_cast<float>(ambient)};
  light.truth = {Image<float>{width, height}, Image<Vec3f>{width, height},
                 Image<float>{width, height, 0.5F}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::vector<Way> ways = waysOf(x, y);
      light.truth.range_m(x, y) = static_cast<float>(ways.front().range_m);
      for (const Way& way : ways) light.steady(x, y) += static_cast<float>(way.radiance);
      for (std::size_t f = 0; f < light.frequencies.size(); ++f) {
        for (int n = 1; n <= harmonics; ++n) {
          std::complex<double> sum;
          for (const Way& way : ways) {
            sum += std::polar(way.radiance, -4.0 * std::numbers::pi * n *
                                                light.frequencies[f].in(hertz)*way.range_m /
                                                kSpeedOfLight_m_per_s);
          }
          light.phasor(f, n)(x, y) = std::complex<float>(sum);
        }
      }
    }
  }
  return light;
}

}  // namespace toftwin::sim
