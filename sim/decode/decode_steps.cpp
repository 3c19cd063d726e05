// SPDX-License-Identifier: Apache-2.0
#include "sim/decode/decode_steps.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace toftwin::sim {

double rangeOfWay(double half_way_m, double ray_x, const DecodeSettings& settings) {
  const double baseline_m = settings.baseline_length.in(metre);
  if (baseline_m == 0.0) return half_way_m;
  const double way_m = 2.0 * half_way_m;
  const double square =
      settings.baseline == DecodeSettings::Baseline::Exact ? baseline_m * baseline_m : 0.0;
  return (way_m * way_m - square) / (2.0 * (way_m - baseline_m * ray_x));
}

void linearise(const std::vector<float>& true_cycles, std::span<float> cycles) {
  const auto last = static_cast<float>(true_cycles.size() - 1);
  for (float& seen : cycles) {
    if (std::isnan(seen)) continue;
    const float at = std::clamp(seen, 0.0F, 1.0F) * last;
    const float below = std::min(std::floor(at), last - 1.0F);
    const auto i = static_cast<std::size_t>(below);
    const float true_value = std::lerp(true_cycles[i], true_cycles[i + 1], at - below);
    seen = true_value - std::floor(true_value);
  }
}

std::vector<float> zeroCycles(const DecodeSettings& settings, std::size_t frequencies) {
  std::vector<float> zeros(frequencies, 0.0F);
  for (std::size_t f = 0; f < std::min(settings.zero_phase.size(), frequencies); ++f) {
    const double zero = settings.zero_phase[f].in(radian) / (2.0 * std::numbers::pi);
    zeros[f] = static_cast<float>(zero - std::floor(zero));
  }
  return zeros;
}

void takeOffPixelPhase(const DecodeSettings& settings, std::size_t frequency, int y,
                       std::span<std::complex<float>> phasors) {
  if (frequency >= settings.pixel_turns.size() || settings.pixel_turns[frequency].empty()) return;
  const std::complex<float>* turns = &settings.pixel_turns[frequency](0, y);
  for (std::size_t x = 0; x < phasors.size(); ++x) phasors[x] *= turns[x];
}

}  // namespace toftwin::sim
