// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

namespace toftwin::sim {

/// Noise of a charge that is converted into whole steps: its variance in electrons², per electron and on top. With noise
/// of more than half a step nothing of the steps is left in a mean; taken without it, they would be errors that no mean
/// over frames has. An effect that has it gives the mean of its codes over it, for which the charge must be free of noise
/// itself. The noise is that of the charge which is converted: behind an effect that takes charge away after it was
/// counted (ambient suppression, a full well) the steps are taken for sharper than they are. No numbers of an effect, so
/// that no file has them.
struct NoiseOfCharge {
  double fano = 0.0, variance = 0.0;

  [[nodiscard]] bool isAny() const { return fano > 0.0 || variance > 0.0; }
  [[nodiscard]] double varianceOf(double electrons) const { return variance + fano * std::max(0.0, electrons); }
};

/// The mean of round(x + σ z) for a standard normal z, less x: the waves of the staircase, each damped by the
/// noise (B. Widrow, I. Kollár, Quantization Noise, 2008, ch. 4), Σ_k (−1)^k / (πk) exp(−2π²k²σ²) sin(2πkx).
inline double meanOfRounding(double x, double sigma) {
  constexpr double kTwoPi = 2.0 * std::numbers::pi;
  if (sigma < 0.1) return std::nearbyint(x) - x;  // too many waves, and all but nothing is damped
  double sum = 0.0;
  for (int k = 1; k <= 6; ++k) {
    const double damping = std::exp(-0.5 * kTwoPi * kTwoPi * k * k * sigma * sigma);
    if (damping < 1e-6) break;
    sum += (k % 2 == 0 ? 1.0 : -1.0) / (std::numbers::pi * k) * damping * std::sin(kTwoPi * k * x);
  }
  return sum;
}

}  // namespace toftwin::sim
