// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/free_numbers.h"

#include <algorithm>
#include <iterator>
#include <type_traits>
#include <utility>
#include <variant>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "sim/sensor/parameters.h"

namespace toftwin::validate {
namespace {

bool isNoise(const sim::AnyEffect& effect) {
  return std::visit(
      []<class E>(const E&) {
        return std::is_same_v<E, sim::ShotNoise> || std::is_same_v<E, sim::ReadNoise> ||
               std::is_same_v<E, sim::RangeNoise> || std::is_same_v<E, sim::Companding>;
      },
      effect);
}

}  // namespace

std::string problemOf(const FreeNumber& number, const std::vector<sim::AnyEffect>& effects, double value) {
  for (std::size_t i = 0; i < number.keys.size() && i < effects.size(); ++i) {
    if (number.keys[i].empty()) continue;
    sim::NumberSetter setter{number.keys[i], value * (number.per.empty() ? 1.0 : number.per[i])};
    std::visit([&](auto effect) { effect.visit(setter); }, effects[i]);
    if (!setter.is_set) return fmt::format("\"{}\" is no number of that effect", number.keys[i]);
    if (!setter.problem.empty()) return number.keys[i] + " " + setter.problem;
  }
  return {};
}

std::vector<sim::AnyEffect> effectsAt(const EffectGroup& group, std::span<const double> values) {
  std::vector<sim::AnyEffect> effects = group.effects;
  for (std::size_t n = 0; n < group.numbers.size(); ++n) {
    const FreeNumber& number = group.numbers[n];
    for (std::size_t i = 0; i < number.keys.size(); ++i) {
      if (number.keys[i].empty()) continue;
      sim::NumberSetter setter{number.keys[i], values[n] * (number.per.empty() ? 1.0 : number.per[i])};
      std::visit([&](auto& effect) { effect.visit(setter); }, effects[i]);
    }
  }
  return effects;
}

sim::SensorModel withMore(const sim::SensorModel& camera, std::vector<sim::AnyEffect> more, bool in_place) {
  std::vector<sim::AnyEffect> effects = camera.effects();
  std::erase_if(effects, [&](const sim::AnyEffect& own) {
    return in_place && std::ranges::any_of(more, [&](const sim::AnyEffect& one) { return one.index() == own.index(); });
  });
  std::ranges::move(more, std::back_inserter(effects));
  return camera.withEffects(std::move(effects));
}

sim::SensorModel withoutNoise(const sim::SensorModel& camera) {
  std::vector<sim::AnyEffect> effects = camera.effects();
  std::erase_if(effects, isNoise);
  return camera.withEffects(std::move(effects));
}

CurveFit fitNumbers(std::span<const double> y, const std::vector<FreeNumber>& numbers, const std::vector<bool>& is_free,
                    const PredictNumbers& predict, const Blocks& blocks) {
  std::vector<Bounded> bounded;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (is_free[i]) bounded.push_back({numbers[i].start, numbers[i].low, numbers[i].high});
  }
  const auto whole = [&](std::span<const double> free) {
    std::vector<double> all;
    std::size_t at = 0;
    for (const bool is : is_free) all.push_back(is ? free[at++] : kNaN);
    return all;
  };
  CurveFit fit = fitCurve(y, bounded, [&](std::span<const double> free) { return predict(whole(free)); }, blocks);
  fit.value = whole(fit.value), fit.error = whole(fit.error);
  return fit;
}

std::vector<std::string> causesOf(const std::vector<FreeNumber>& numbers) {
  std::vector<std::string> causes;
  for (const FreeNumber& number : numbers) {
    if (std::ranges::find(causes, number.causeName()) == causes.end()) causes.push_back(number.causeName());
  }
  return causes;
}

}  // namespace toftwin::validate
