// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/unequal_exposures.h"

#include <algorithm>
#include <variant>

#include <fmt/format.h>

#include "calib/discover/campaign/model_file.h"

namespace toftwin::discover {
namespace {

constexpr double kUnit = 0.01;
/// Farther off, the first order says nothing.
constexpr double kMostUnits = 50.0;

sim::AnyEffect amplified(int step, int tap) { return sim::SampleGain{.step = step, .tap = tap, .gain = kUnit}; }
sim::AnyEffect late(int step) { return sim::StepPhase{.step = step, .error = kUnit * radian}; }

/// The effect of so many units, into one of the same raw exposure and tap, or as one more.
void add(const sim::AnyEffect& unit, double units, std::vector<LearnedEffect>& learned) {
  if (const auto* gain = std::get_if<sim::SampleGain>(&unit)) {
    for (LearnedEffect& one : learned) {
      auto* same = std::get_if<sim::SampleGain>(&one.effect);
      if (same == nullptr || same->step != gain->step || same->tap != gain->tap) continue;
      same->gain += units * gain->gain;
      return;
    }
    learned.push_back({sim::SampleGain{.step = gain->step, .tap = gain->tap, .gain = units * gain->gain}, {"gain"}});
  } else if (const auto* phase = std::get_if<sim::StepPhase>(&unit)) {
    learned.push_back({sim::StepPhase{.step = phase->step, .error = units * phase->error}, {"error_rad"}});
  }
}

}  // namespace

std::vector<UnequalExposure> unequalExposures(int steps, int taps) {
  if (steps < 4 || steps % 4 != 0) return {};
  const auto name = [](std::string_view carrier, const char* part) { return fmt::format("{}:{}", carrier, part); };
  std::vector<UnequalExposure> all{{name(kUnequalCarrier, "gain"), {}}, {name(kUnequalCarrier, "phase"), {late(0)}}};
  for (int tap = 0; tap < taps; ++tap) all.front().second.push_back(amplified(0, tap));
  if (taps > 1) all.push_back({name(kAmplifiedCarrier, "first"), {amplified(0, 0)}});
  all.push_back({name(kAmplifiedCarrier, "quarter"), {amplified(steps / 4, 0)}});
  return all;
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
        for (const sim::AnyEffect& unit : effects) add(unit, std::clamp(coefficient, -kMostUnits, kMostUnits), learned);
  return learned;
}

}  // namespace toftwin::discover
