// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/captures/effect_numbers.h"

#include <algorithm>
#include <cmath>

namespace toftwin::discover {

double valueOf(const sim::AnyEffect& effect, const std::string& key) {
  for (const EffectNumber& number : numbersOf(effect)) {
    if (number.key == key) return number.value;
  }
  return 0.0;
}

/// Not by a share of the bounds' distance: a millionth of what a window may reflect at most is five times
/// what windows do.
bool isAtBound(const sim::AnyEffect& effect, const std::vector<std::string>& keys) {
  const auto is_at = [](double value, double bound) {  // units make them differ by rounding
    return std::abs(value - bound) <= 1e-12 * std::abs(bound);
  };
  return std::ranges::any_of(numbersOf(effect), [&](const EffectNumber& number) {
    return isStrength(effect, number.key) && std::ranges::count(keys, number.key) > 0 &&
           (is_at(number.value, number.low) || is_at(number.value, number.high));
  });
}

std::optional<LeastStrength> leastStrength(const FittedEffect& fitted, const std::vector<std::string>& strengths,
                                           const std::vector<std::string>& needed) {
  const sim::AnyEffect none = noneOf(fitted.effect);
  std::optional<LeastStrength> least;
  int count = 0;
  for (const FittedNumber& number : fitted.numbers) {
    if (std::ranges::find(strengths, number.key) == strengths.end()) continue;
    ++count;
    if (std::ranges::find(needed, number.key) != needed.end()) continue;
    // What the data say nothing of has no error.
    const double errors =
        number.error > 0.0 ? std::abs(number.value - valueOf(none, number.key)) / number.error : 0.0;
    if (!least || errors < least->errors) least = LeastStrength{number.key, errors};
  }
  return count > 1 ? least : std::nullopt;
}

sim::AnyEffect without(const sim::AnyEffect& effect, const std::string& key) {
  return withNumber(effect, key, valueOf(noneOf(effect), key));  // 0 where that has no such number: an empty list
}

std::vector<sim::AnyEffect> moved(std::vector<sim::AnyEffect> effects, const FreeNumber& free, double by) {
  effects[free.place] =
      withNumber(effects[free.place], free.key, valueOf(effects[free.place], free.key) + by);
  return effects;
}

bool actsOnLight(const std::vector<sim::AnyEffect>& effects) {
  return std::ranges::any_of(effects, [](const auto& effect) { return discover::stageOf(effect) == Stage::Light; });
}

/// A twentieth of what the effect has, or of a tenth of what its defaults have; where those have nothing, at least a ten
/// thousandth of the bounds: a step that shrinks with a number that nothing tells is rounding alone.
std::vector<FreeNumber> freeNumbersOf(const std::vector<sim::AnyEffect>& effects,
                                      const std::vector<std::size_t>& places) {
  std::vector<FreeNumber> all;
  for (const std::size_t place : places) {
    const sim::AnyEffect defaults = defaultsOf(effects[place]);
    for (const EffectNumber& number : numbersOf(effects[place])) {
      if (number.is_whole) continue;
      const double usual = 0.1 * std::abs(valueOf(defaults, number.key));
      double step = 0.05 * std::max(std::abs(number.value), usual);
      if (usual == 0.0) step = std::max(step, 1e-4 * (number.high - number.low));
      if (number.value + step > number.high) step = -step;
      all.push_back({place, number.key, step});
    }
  }
  return all;
}

}  // namespace toftwin::discover
