// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <string>
#include <vector>

#include "tests/sim/camera_testing.h"

namespace toftwin::sim {

/// A camera file of one raw tap whose samples are B + A cos(φ − θₖ), or of two whose difference has
/// amplitude 2A: radiance `amplitude` + ambient collects, per tap, 1 electron per unit of radiance.
struct PhaseRig {
  int steps = 4;
  int taps = 1;
  double frequency_mhz = 30.0;
  double amplitude = 1000.0;  ///< A, electrons
  double mean = 3000.0;       ///< B, electrons: what A does not explain is ambient light
  std::string effects{};      ///< [[effect]] tables
  std::string modulation = "emitted = 'sine'\ndemodulated = 'impulse'\n";
  int harmonics = 5;
  Moment moment{};

  [[nodiscard]] SensorModel model() const {
    return modelOf("[lens]\nwidth = 360\nheight = 1\ncy = 0\n[[emitter]]\n[[modulation]]\nfrequency_mhz = " +
                   std::to_string(frequency_mhz) + "\nexposure_us = 1000\ncontrast = " + "0.5\n" +
                   modulation + "[sampling]\nfactory_calibration = 'none'\nsteps = " +
                   std::to_string(steps) + "\ntaps = " + std::to_string(taps) +
                   "\nharmonics = " + std::to_string(harmonics) +
                   "\n[pixel]\nelectrons_per_radiance_s = 4e3\n" + effects);
  }
};

/// What a rig measures over one turn of the phase, in 360 steps.
struct Turn {
  std::vector<double> phase_rad;    ///< true
  std::vector<double> error_rad;    ///< estimated − true
  std::vector<double> closure;      ///< ((S₀+S₂) − (S₁+S₃)) / A, four single-ended steps only
  std::vector<double> amplitude;    ///< estimated, electrons

  /// Amplitude of the Fourier component of `values` with so many cycles per turn; 0: the mean.
  [[nodiscard]] static double cycles(const std::vector<double>& values, int count) {
    std::complex<double> sum;
    const auto n = static_cast<double>(values.size());
    for (std::size_t i = 0; i < values.size(); ++i)
      sum += values[i] * std::polar(1.0, -2.0 * kPi * count * (static_cast<double>(i) + 0.5) / n);
    return (count == 0 ? 1.0 : 2.0) * std::abs(sum) / n;
  }
  [[nodiscard]] double errorCycles(int count) const { return cycles(error_rad, count); }
  [[nodiscard]] double closureCycles(int count) const { return cycles(closure, count); }
  [[nodiscard]] double mean() const {
    double sum = 0.0;
    for (double error : error_rad) sum += error;
    return sum / static_cast<double>(error_rad.size());
  }
  /// Largest deviation from the mean.
  [[nodiscard]] double peak() const {
    double largest = 0.0;
    for (double error : error_rad) largest = std::max(largest, std::abs(error - mean()));
    return largest;
  }
  /// The largest Fourier component of the error besides those named.
  [[nodiscard]] double otherCycles(std::initializer_list<int> named) const {
    double largest = 0.0;
    for (int count = 1; count <= 20; ++count) {
      if (std::find(named.begin(), named.end(), count) == named.end())
        largest = std::max(largest, errorCycles(count));
    }
    return largest;
  }
};

/// Exposes one turn of the phase with the rig's camera. In the rig's taps a radiance of 1 collects one
/// electron, half of it modulated: steady 2A and contrast one half make A, ambient the rest of B.
inline Turn turnOf(const PhaseRig& rig) {
  const SensorModel model = rig.model();
  constexpr int kPhases = 360;
  const double period_m = unambiguousRange(rig.frequency_mhz * megahertz).in(metre);
  const auto phaseAt = [](int x) { return 2.0 * kPi * (x + 0.5) / kPhases; };
  const Light light = syntheticLight(
      kPhases, 1, {rig.frequency_mhz * megahertz}, rig.harmonics,
      [&](int x, int) {
        return std::vector<Way>{{rig.amplitude, phaseAt(x) / (2.0 * kPi) * period_m}};
      },
      0.5 * rig.mean - rig.amplitude);
  const auto exposed = model.expose(light, rig.moment, 1, 0);
  Turn turn;
  double last = 0.0;
  for (int x = 0; x < kPhases; ++x) {
    const std::complex<double> p{exposed.range.phasors[0](x, 0)};
    const double error = -std::arg(p) - phaseAt(x);
    last += std::remainder(error - last, 2.0 * kPi);  // continuous over the turn
    turn.phase_rad.push_back(phaseAt(x));
    turn.error_rad.push_back(last);
    turn.amplitude.push_back(std::abs(p));
    if (rig.steps != 4 || rig.taps != 1) continue;
    const auto s = [&](int k) { return static_cast<double>(exposed.samples.tap(0, k, 0)(x, 0)); };
    turn.closure.push_back(((s(0) + s(2)) - (s(1) + s(3))) / rig.amplitude);
  }
  return turn;
}

}  // namespace toftwin::sim
