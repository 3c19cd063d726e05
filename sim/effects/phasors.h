// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstddef>
#include <numbers>

#include "sim/images/light.h"
#include "sim/images/rows.h"

namespace toftwin::sim {

/// Pₙ → Pₙ · factor(f, n) for every frequency's number f and harmonic n, the same in all pixels.
template <class Factor>
void multiplyPhasors(Light& light, const Factor& factor) {
  for (std::size_t f = 0; f < light.frequencies.size(); ++f) {
    for (int n = 1; n <= light.harmonics; ++n) {
      auto& phasors = light.phasor(f, n);
      if (phasors.empty()) continue;  // nobody looks at this harmonic
      const std::complex<float> by{std::complex<double>{factor(f, n)}};
      forRows(light.height(), [&](int first_row, int last_row) {
        for (int y = first_row; y < last_row; ++y) {
          std::complex<float>* row = &phasors(0, y);
          for (int x = 0; x < light.width(); ++x) {
            // Written out: std::complex's product would look for NaN and not vectorise.
            row[x] = {row[x].real() * by.real() - row[x].imag() * by.imag(),
                      row[x].real() * by.imag() + row[x].imag() * by.real()};
          }
        }
      });
    }
  }
}

/// Calls work(image) for every image that light consists of: the phasors, steady and ambient. Harmonics
/// that nobody looks at are empty and left out.
template <class Work>
void forEachImage(Light& light, const Work& work) {
  for (auto& phasors : light.phasors) {
    if (!phasors.empty()) work(phasors);
  }
  work(light.steady);
  work(light.ambient);
}

/// Phase of light that is modulated at `modulation` and takes `range` there and back: 4π f r / c.
inline double phaseOfRange(Length range, Frequency modulation) {
  return 2.0 * std::numbers::pi * (range / unambiguousRange(modulation));
}

}  // namespace toftwin::sim
