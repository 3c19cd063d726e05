// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/unequal_exposures.h"

#include <algorithm>
#include <variant>

#include <fmt/format.h>

#include "calib/discover/campaign/rows/learned_effect.h"

namespace toftwin::discover {
namespace {

constexpr double kUnit = 0.01;
/// Farther off, the first order says nothing.
constexpr double kMostGain = 0.5, kMostPhase_rad = 0.5;

sim::AnyEffect amplified(int step, int tap) { return sim::SampleGain{.step = step, .tap = tap, .gain = kUnit}; }
sim::AnyEffect late(int step) { return sim::StepPhase{.step = step, .error = kUnit * radian}; }

/// The effect of so many units, into one of the same raw exposure and tap, or as one more.
void add(const sim::AnyEffect& unit, double units, std::vector<LearnedEffect>& learned) {
  if (const auto* gain = std::get_if<sim::SampleGain>(&unit)) {
    const double more = units * gain->gain;
    for (LearnedEffect& one : learned) {
      auto* same = std::get_if<sim::SampleGain>(&one.effect);
      if (same == nullptr || same->step != gain->step || same->tap != gain->tap) continue;
      same->gain = std::clamp(same->gain + more, -kMostGain, kMostGain);
      return;
    }
    learned.push_back({sim::SampleGain{gain->step, gain->tap, std::clamp(more, -kMostGain, kMostGain)}, {"gain"}});
  } else if (const auto* phase = std::get_if<sim::StepPhase>(&unit)) {
    const double by_rad = std::clamp(units * phase->error.in(radian), -kMostPhase_rad, kMostPhase_rad);
    learned.push_back({sim::StepPhase{.step = phase->step, .error = by_rad * radian}, {"error_rad"}});
  }
}

}  // namespace

std::vector<UnequalExposure> unequalExposures(int steps, int taps) {
  if (steps < 3 || taps != 2) return {};
  const auto name = [](std::string_view carrier, const char* part) { return fmt::format("{}:{}", carrier, part); };
  const int second = steps % 4 == 0 ? steps / 4 : 1;
  return {{name(kUnequalCarrier, "gain"), {amplified(0, 0), amplified(0, 1)}},
          {name(kUnequalCarrier, "phase"), {late(0)}},
          {name(kAmplifiedCarrier, "first"), {amplified(0, 0)}},
          {name(kAmplifiedCarrier, "second"), {amplified(second, 0)}}};
}

std::vector<TermGroup> unequalGroups(std::span<const UnequalExposure> carriers) {
  if (carriers.empty()) return {};
  TermGroup unequal{"raw exposures that differ in brightness and phase", Kind::Generic, {}, 0},
      amplified{"raw exposures that differ, and are amplified unequally", Kind::Generic, {}, 0};
  for (const auto& [carrier, effects] : carriers) {
    const bool is_of_taps = carrier.starts_with(kAmplifiedCarrier);
    if (!is_of_taps) unequal.terms.push_back({{}, Stage::Light, carrier});
    amplified.terms.push_back({{}, Stage::Samples, carrier});
  }
  unequal.simpler_than = kUnequalCarrier;
  return {std::move(unequal), std::move(amplified)};
}

std::vector<LearnedEffect> unequalOf(std::span<const UnequalExposure> carriers,
                                     std::span<const std::pair<Term, double>> terms) {
  std::vector<LearnedEffect> learned;
  for (const auto& [term, coefficient] : terms)
    for (const auto& [carrier, effects] : carriers)
      if (term.carrier == carrier && term.factors.empty())
        for (const sim::AnyEffect& unit : effects) add(unit, coefficient, learned);
  return learned;
}

}  // namespace toftwin::discover
