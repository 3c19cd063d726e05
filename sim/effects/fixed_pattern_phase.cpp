// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/fixed_pattern_phase.h"

#include <cmath>
#include <vector>

#include "sim/images/rows.h"
#include "sim/images/simd.h"

namespace toftwin::sim {
namespace {

/// cos and sin of sigma · angles, for up to some hundred radians: the angle less its quarter turns (π/2 in
/// three parts, Cody and Waite), then Taylor series to the 8th and 9th power, wrong by less than 5e-8 on
/// ±π/4.
TOFTWIN_SIMD void turnsOf(const float* angles, std::size_t count, float sigma, float* cosine,
                          float* sine) {
  for (std::size_t i = 0; i < count; ++i) {
    const float angle = sigma * angles[i];
    const float quarters = (angle * 0.636619772F + 12582912.0F) - 12582912.0F;  // to a whole number
    const float r = ((angle - quarters * 1.5703125F) - quarters * 4.8375129699707031e-4F) -
                    quarters * 7.5497899548918861e-8F;
    const float r2 = r * r;
    const float s = r * (1.0F + r2 * (-1.0F / 6.0F +
                                      r2 * (1.0F / 120.0F + r2 * (-1.0F / 5040.0F + r2 / 362880.0F))));
    const float c =
        1.0F + r2 * (-0.5F + r2 * (1.0F / 24.0F + r2 * (-1.0F / 720.0F + r2 * (1.0F / 40320.0F))));
    const int quarter = static_cast<int>(quarters) & 3;
    const float upright = (quarter & 1) != 0 ? s : c, across = (quarter & 1) != 0 ? c : s;
    cosine[i] = quarter == 1 || quarter == 2 ? -upright : upright;
    sine[i] = quarter >= 2 ? -across : across;
  }
}

/// Pₙ → Pₙ (cos − i sin)ⁿ along a row, for all harmonics of a frequency in turn.
void turnRow(Light& light, std::size_t f, int y, const float* cosine, const float* sine) {
  const auto width = static_cast<std::size_t>(light.width());
  std::vector<float> real(cosine, cosine + width), imaginary(width);
  for (std::size_t x = 0; x < width; ++x) imaginary[x] = -sine[x];
  for (int n = 1; n <= light.harmonics; ++n) {
    auto& phasors = light.phasor(f, n);
    if (!phasors.empty()) {
      std::complex<float>* p = &phasors(0, y);
      for (std::size_t x = 0; x < width; ++x) {
        p[x] = {p[x].real() * real[x] - p[x].imag() * imaginary[x],
                p[x].real() * imaginary[x] + p[x].imag() * real[x]};
      }
    }
    for (std::size_t x = 0; x < width; ++x) {
      const float next = real[x] * cosine[x] + imaginary[x] * sine[x];
      imaginary[x] = imaginary[x] * cosine[x] - real[x] * sine[x];
      real[x] = next;
    }
  }
}

}  // namespace

Light FixedPatternPhase::apply(Light light, const Conditions& now, const Random&) const {
  const auto sigma_rad = static_cast<float>(sigma.in(radian));
  if (sigma_rad == 0.0F) return light;
  // Keyed by the device alone: the pattern must be the same in every frame and for every seed.
  const Random pattern{device, 0, effectKey(about.name, 0)};
  const auto width = static_cast<std::size_t>(light.width());
  forRows(light.height(), [&](int first_row, int last_row) {
    std::vector<float> normals(width), cosine(width), sine(width);
    for (std::size_t f = 0; f < light.frequencies.size(); ++f) {
      const Random::Draw draw = pattern.draw(f);
      for (int y = first_row; y < last_row; ++y) {
        fillNormals(draw, now.pixel(0, y), normals);
        turnsOf(normals.data(), width, sigma_rad, cosine.data(), sine.data());
        turnRow(light, f, y, cosine.data(), sine.data());
      }
    }
  });
  return light;
}

}  // namespace toftwin::sim
