// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor/pulse.h"

#include <algorithm>
#include <cmath>

#include "sim/images/rows.h"

namespace toftwin::sim {
namespace {

/// The ratio that the decoder takes for a range (pulsed.h), of a single return at it.
double ratioAt(const Pulse& pulse, double range_m) {
  const Duration delay = 2.0 * range_m / kSpeedOfLight_m_per_s * second;
  const double first = pulse.gateShare(0, delay), second_share = pulse.gateShare(1, delay);
  return pulse.scheme == PulseScheme::ShortLong ? 1.0 - first / second_share
                                                : second_share / (first + second_share);
}

}  // namespace

/// P(t) = ∫₀ᵗ of the rectangle 1/T after the low pass 1/r e^(−t/r):
///     0 ≤ t ≤ T:  (t − r (1 − e^(−t/r))) / T
///     t > T:      1 − r/T (e^(−(t−T)/r) − e^(−t/r))
double Pulse::arrivedBefore(Duration time) const {
  const double t = time.in(nanosecond), length = width.in(nanosecond), r = rise.in(nanosecond);
  if (t <= 0.0) return 0.0;
  if (r <= 0.0) return std::min(1.0, t / length);
  if (t <= length) return (t - r * (1.0 - std::exp(-t / r))) / length;
  return 1.0 - r / length * (std::exp(-(t - length) / r) - std::exp(-t / r));
}

double Pulse::gateShare(int gate, Duration delay) const {
  const bool is_second = gate == 1;
  const Duration open = is_second && scheme == PulseScheme::TwoGate ? width : 0_ns;
  const Duration close = is_second ? 2.0 * width : width;
  return arrivedBefore(close - delay) - arrivedBefore(open - delay);
}

double Pulse::gateWidth(int gate) const {
  return gate == 1 && scheme == PulseScheme::ShortLong ? 2.0 : 1.0;
}

PathFunctions gateFunctionsOf(const Pulse& pulse) {
  // A way of 2 c T comes back when all gates are closed. The gates' edges fall on knots.
  constexpr int kKnots = 8192;
  const double longest_m = 2.0 * kSpeedOfLight_m_per_s * pulse.width.in(second);
  PathFunctions functions{.step = longest_m / kKnots * metre, .first = {}, .second = {}};
  for (int i = 0; i <= kKnots; ++i) {
    const Duration delay = 2.0 * pulse.width * (static_cast<double>(i) / kKnots);
    functions.first.push_back(static_cast<float>(pulse.gateShare(0, delay)));
    functions.second.push_back(static_cast<float>(pulse.gateShare(1, delay)));
  }
  return functions;
}

Samples collectGates(const Light& light, const Pulse& pulse, double electrons_per_radiance,
                     double open_share) {
  const int width = light.width(), height = light.height(), gates = pulse.gates();
  Samples samples{.frequencies = {0_MHz}, .steps = gates, .taps = 1};
  samples.electrons.assign(static_cast<std::size_t>(gates), Image<float>{width, height});
  const auto gain = static_cast<float>(electrons_per_radiance);
  forRows(height, [&](int first_row, int last_row) {
    for (int gate = 0; gate < gates; ++gate) {
      const auto open = static_cast<float>(open_share * pulse.gateWidth(gate));
      for (int y = first_row; y < last_row; ++y) {
        float* electrons = &samples.electrons[static_cast<std::size_t>(gate)](0, y);
        const float* ambient = &light.ambient(0, y);
        const std::complex<float>* charges = &light.phasors[0](0, y);
        for (int x = 0; x < width; ++x) {
          const float signal = gate == 0 ? charges[x].real() : gate == 1 ? charges[x].imag() : 0.0F;
          electrons[x] = gain * (signal + ambient[x] * open);
        }
      }
    }
  });
  return samples;
}

std::vector<double> rangesOfRatios(const Pulse& pulse, int knots) {
  const double longest_m = 0.5 * kSpeedOfLight_m_per_s * pulse.width.in(second)*1.25;
  constexpr int kSteps = 20'000;
  std::vector<double> ranges;
  double seen = ratioAt(pulse, 0.0);
  int step = 0;
  for (int i = 0; i < knots; ++i) {
    const double wanted = static_cast<double>(i) / (knots - 1);
    double next = seen;
    while (step < kSteps && (next = ratioAt(pulse, (step + 1) * longest_m / kSteps)) < wanted) {
      seen = next;
      ++step;
    }
    const double share = next > seen ? std::clamp((wanted - seen) / (next - seen), 0.0, 1.0) : 0.0;
    ranges.push_back((step + share) * longest_m / kSteps);
  }
  return ranges;
}

}  // namespace toftwin::sim
