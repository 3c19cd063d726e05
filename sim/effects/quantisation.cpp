// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/quantisation.h"

#include <cmath>

#include "sim/images/rows.h"
#include "sim/images/simd.h"

namespace toftwin::sim {
namespace {

TOFTWIN_SIMD void toSteps(float* electrons, int count, float step) {
  for (int x = 0; x < count; ++x) electrons[x] = step * __builtin_rintf(electrons[x] / step);
}

void toMeansOfSteps(float* electrons, int count, double step, const NoiseOfCharge& noise) {
  for (int x = 0; x < count; ++x) {
    const auto charge = static_cast<double>(electrons[x]);
    electrons[x] += static_cast<float>(step * meanOfRounding(charge / step, std::sqrt(noise.varianceOf(charge)) / step));
  }
}

}  // namespace

Samples Quantisation::apply(Samples samples, const Conditions&, const Random&) const {
  if (step_electrons <= 0.0) return samples;
  const auto step = static_cast<float>(step_electrons);
  const int width = samples.width();
  forRows(samples.height(), [&](int first_row, int last_row) {
    for (Image<float>& image : samples.electrons) {
      for (int y = first_row; y < last_row; ++y) {
        if (mean_over.isAny())
          toMeansOfSteps(&image(0, y), width, step_electrons, mean_over);
        else
          toSteps(&image(0, y), width, step);
      }
    }
  });
  return samples;
}

}  // namespace toftwin::sim
