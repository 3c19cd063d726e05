// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/drawn_effect.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "calib/discover/campaign/captures/effect_numbers.h"

namespace toftwin::discover::bench {
namespace {

/// Of the camera, not of the effect: they are what the camera file says.
bool isOfTheCamera(const std::string& name, const std::string& key) {
  return (name == "duty_drift" && key == "duty") || (name == "rise_drift" && key == "rise_ns");
}

/// The defaults with nothing that differs from an effect that is switched off.
sim::AnyEffect quiet(const sim::AnyEffect& defaults) {
  sim::AnyEffect effect = defaults;
  const auto off = numbersOf(noneOf(defaults));
  for (const EffectNumber& number : numbersOf(defaults)) {
    const auto found = std::ranges::find(off, number.key, &EffectNumber::key);
    effect = withNumber(effect, number.key, found == off.end() ? 0.0 : found->value);
  }
  return effect;
}

double shapeOf(const EffectNumber& number, std::mt19937_64& random) {
  const auto within = [&](double low, double high) {
    return std::uniform_real_distribution{low, high}(random);
  };
  if (number.is_whole) {
    if (number.high - number.low <= 15.0) return std::floor(within(number.low, number.high + 1.0));
    return std::round(within(0.5 * number.value, 2.0 * number.value));
  }
  if (number.key.ends_with("_c")) return number.value + within(-15.0, 15.0);
  if (number.low < 0.0) return within(-3.0, 3.0) * std::abs(number.value);
  return number.value * std::exp(within(std::log(0.4), std::log(2.5)));
}

/// The most that a number is which no default has, and others of its kind have: an even harmonic, which four steps do not
/// see, would be drawn so strong that light would have to be negative.
double mostOf(const sim::AnyEffect& defaults, const EffectNumber& number) {
  constexpr double kTimes = 3.0;
  double most = 0.0;
  for (const EffectNumber& other : numbersOf(defaults))
    if (other.low == number.low && other.high == number.high && isStrength(defaults, other.key))
      most = std::max(most, kTimes * std::abs(other.value));
  return most > 0.0 ? most : std::max(std::abs(number.low), std::abs(number.high));
}

/// A table's numbers are of one size, whatever the captures show of each.
double ofItsTable(const sim::AnyEffect& defaults) {
  double most = 0.0;
  for (const EffectNumber& number : numbersOf(defaults))
    if (number.key.ends_with("]")) most = std::max(most, std::abs(number.value));
  return most;
}

/// By how much the number alone must change to show as much as `lambda`; 0: it shows nothing by itself.
double changeFor(double lambda, const sim::AnyEffect& off, const EffectNumber& number, double typical,
                 const std::function<double(const sim::AnyEffect&)>& lambda_of) {
  const double room = number.high - number.value > 1e-9 * (number.high - number.low) ? number.high - number.value
                                                                                     : number.low - number.value;
  double change = typical != number.value ? typical - number.value : 1e-3 * room;
  for (int pass = 0; pass < 12; ++pass) {
    const double shown = lambda_of(withNumber(off, number.key, number.value + change));
    if (!(shown > 1e-6)) return 0.0;
    if (std::abs(shown / lambda - 1.0) < 0.2) break;
    change *= std::clamp(std::sqrt(lambda / shown), 0.02, 50.0);
    if (std::abs(change) > std::abs(room)) return room;
  }
  return change;
}

}  // namespace

Hidden drawn(const sim::AnyEffect& defaults, double lambda,
             const std::function<double(const sim::AnyEffect&)>& lambda_of, std::uint64_t seed) {
  std::mt19937_64 random{seed};
  const std::string name = nameOf(defaults);
  constexpr int kMostDraws = 40;  // places that this camera has not got show nothing
  const sim::AnyEffect none = quiet(defaults);
  Hidden hidden{none, none};
  for (int draw = 0; draw < kMostDraws; ++draw) {
    sim::AnyEffect off = none;
    std::vector<EffectNumber> acting;
    std::vector<double> changes;
    for (const EffectNumber& number : numbersOf(off)) {
      if (number.is_label || isOfTheCamera(name, number.key)) continue;
      const bool is_strength = isStrength(defaults, number.key);
      const double alone =
          number.key.ends_with("]") ? ofItsTable(defaults)
          : number.is_whole         ? 0.0
                                    : changeFor(lambda, off, number, valueOf(defaults, number.key), lambda_of);
      if (is_strength || alone != 0.0)
        acting.push_back(number), changes.push_back(alone);
      else
        off = withNumber(off, number.key, shapeOf(number, random));
    }
    hidden = {off, off};
    // Once more, with the shapes that were drawn.
    for (std::size_t i = 0; i < acting.size(); ++i) {
      const double typical = valueOf(defaults, acting[i].key);
      const double alone = acting[i].key.ends_with("]")              ? changes[i]
                           : changes[i] == 0.0 || acting[i].is_whole ? typical - acting[i].value
                                                                     : changeFor(lambda, off, acting[i], typical, lambda_of);
      double share = std::normal_distribution{}(random);
      if (acting[i].value + share * alone < acting[i].low || acting[i].value + share * alone > acting[i].high)
        share = -share;
      const double most = mostOf(defaults, acting[i]);
      const double value = acting[i].value + (acting[i].is_whole ? alone : share * alone);
      hidden.on = withNumber(hidden.on, acting[i].key, std::clamp(value, -most, most));
    }
    if (lambda_of(hidden.on) > 1e-3) break;
  }
  return hidden;
}

}  // namespace toftwin::discover::bench
