// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned_light.h"

#include <cmath>
#include <complex>

#include <toftwin/nan.h>

#include "sim/effects/phasors.h"

namespace toftwin::sim {
namespace {

/// The covariate at each pixel; NaN where it is not known.
Image<float> covariateOf(LearnedOver over, const Light& light, const Conditions& now) {
  const int width = light.width(), height = light.height();
  if (over == LearnedOver::Range) return light.truth.range_m;
  if (over == LearnedOver::Albedo && !light.truth.albedo.empty()) return light.truth.albedo;
  if (over >= LearnedOver::Surround4) return surroundings(light.steady, reachOf(over, width, height));
  const double same = ofFrame(over, now.moment);
  Image<float> image(width, height, static_cast<float>(same));
  if (!std::isnan(same)) return image;
  const bool is_incidence = over == LearnedOver::Incidence;
  if (is_incidence && light.truth.normal.empty()) return image;
  forRows(height, [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      for (int x = 0; x < width; ++x) {
        image(x, y) = static_cast<float>(
            is_incidence ? incidenceAt(now.camera, light.truth.normal(x, y), now.left + x, now.top + y)
                         : ofPlace(over, now, x, y));
      }
    }
  });
  return image;
}

/// A table's value at each pixel; 0 where a covariate is not known.
Image<float> valuesOf(const LearnedKnots& knots, const std::vector<double>& table, const Image<float>& x,
                      const Image<float>& y) {
  Image<float> values(x.width(), x.height());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double value = knots.valueIn(table, static_cast<double>(x[i]), static_cast<double>(y[i]));
    values[i] = std::isnan(value) ? 0.0F : static_cast<float>(value);
  }
  return values;
}

/// Pₙ → Pₙ exp(−i 4π n f t/c)
void delay(Light& light, const Image<float>& by_mm) {
  for (std::size_t f = 0; f < light.frequencies.size(); ++f) {
    const double turn_per_mm = phaseOfRange(1_mm, light.frequencies[f]);
    for (int n = 1; n <= light.harmonics; ++n) {
      auto& phasors = light.phasor(f, n);
      for (std::size_t i = 0; i < phasors.size(); ++i)
        phasors[i] *= std::complex<float>{std::polar(1.0, -n * turn_per_mm * static_cast<double>(by_mm[i]))};
    }
  }
}

void brighten(Light& light, const Image<float>& by_percent) {
  const auto brightened = [&](auto& image) {
    for (std::size_t i = 0; i < image.size(); ++i) image[i] *= 1.0F + 0.01F * by_percent[i];
  };
  for (auto& phasors : light.phasors) brightened(phasors);
  brightened(light.steady);
}

}  // namespace

Light LearnedLight::apply(Light light, const Conditions& now, const Random&) const {
  if (knots.empty()) return light;
  const LearnedKnots at{knots, and_knots};
  const Image<float> x = covariateOf(over, light, now), y = covariateOf(and_over, light, now);
  if (x.empty() || y.empty()) return light;  // nobody knows the scene
  if (!delays_mm.empty()) delay(light, valuesOf(at, delays_mm, x, y));
  if (!gains_percent.empty()) brighten(light, valuesOf(at, gains_percent, x, y));
  return light;
}

}  // namespace toftwin::sim
