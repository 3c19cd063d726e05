// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor/factory_calibration.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace toftwin::sim {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

/// Phase in cycles that N samples show for a single return at `true_cycles`, the zero phase taken off:
///     Sₖ = Re Σₙ ĉₙ e^(−inφ) e^(inθₖ),   p = (2/N) Σₖ Sₖ e^(−iθₖ)
/// as in correlate.h and demodulate.h; within half a cycle of the truth.
double seenCycles(const Response& response, int steps, double true_cycles) {
  std::complex<double> p = 0.0;
  for (int k = 0; k < steps; ++k) {
    const double step_angle = kTurn * k / steps;
    double sample = 0.0;
    for (std::size_t i = 0; i < response.harmonics.size(); ++i) {
      const double n = static_cast<double>(i + 1);
      sample += std::real(response.harmonics[i] * std::polar(1.0, n * (step_angle - kTurn * true_cycles)));
    }
    p += sample * std::polar(1.0, -step_angle);
  }
  const double seen = (-std::arg(p) - response.zeroPhase().in(radian)) / kTurn;
  return seen - std::round(seen - true_cycles);
}

}  // namespace

std::vector<float> trueCyclesOf(const Response& response, int steps) {
  constexpr int kTrue = 8192, kSeen = 4096;
  // From a cycle before to a cycle after, so that the table's ends are inside.
  std::vector<double> truth, seen;
  double farthest = -2.0;
  for (int i = -kTrue; i <= 2 * kTrue; ++i) {
    truth.push_back(static_cast<double>(i) / kTrue);
    farthest = std::max(farthest, seenCycles(response, steps, truth.back()));
    seen.push_back(farthest);
  }
  std::vector<float> table;
  for (int i = 0; i <= kSeen; ++i) {
    const double cycles = static_cast<double>(i) / kSeen;
    const auto above = std::upper_bound(seen.begin(), seen.end(), cycles);
    const auto j = static_cast<std::size_t>(above - seen.begin());
    const double share = (cycles - seen[j - 1]) / (seen[j] - seen[j - 1]);
    table.push_back(static_cast<float>(std::lerp(truth[j - 1], truth[j], share)));
  }
  return table;
}

std::vector<Image<std::complex<float>>> pixelTurnsOf(const std::vector<AnyEffect>& effects,
                                                     const std::vector<Response>& responses,
                                                     const CameraInfo& camera) {
  const auto isMeasured = [](const AnyEffect& any) {
    return actsOn<Light>(any) && explainsOf(any) == Covariates{Covariate::Position};
  };
  if (std::ranges::none_of(effects, isMeasured)) return {};
  Light light;
  for (const Response& response : responses) {
    light.frequencies.push_back(response.frequency);
    light.phasors.emplace_back(camera.width, camera.height, std::complex<float>{1.0F});
  }
  light.steady = light.ambient = Image<float>{camera.width, camera.height};
  const Moment moment;
  const Conditions now{moment, camera};
  for (std::size_t place = 0; place < effects.size(); ++place) {
    if (!isMeasured(effects[place])) continue;
    std::visit(
        [&]<class E>(const E& effect) {
          if constexpr (ActsOn<E, Light>)
            light = effect.apply(std::move(light), now, Random{0, 0, effectKey(E::about.name, place)});
        },
        effects[place]);
  }
  constexpr double kStep_rad = 0.000031 * std::numbers::pi;
  for (Image<std::complex<float>>& phasor : light.phasors) {
    for (std::complex<float>& p : phasor.pixels()) {
      const double table = std::round(-static_cast<double>(std::arg(p)) / kStep_rad) * kStep_rad;
      p = std::complex<float>{std::polar(1.0, table)};
    }
  }
  return std::move(light.phasors);
}

}  // namespace toftwin::sim
