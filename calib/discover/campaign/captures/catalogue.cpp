// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/captures/catalogue.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <type_traits>
#include <variant>

#include <toftwin/fields.h>
#include <toftwin/units.h>

namespace toftwin::discover {
namespace {

/// A change that is about as large as effects are: larger ones would no longer be proportional.
constexpr double kTooMuch = 5.0;
/// A column of which less than this share is new says what those before it say already: it would
/// only make the effect fit noise.
constexpr double kNew = 0.2;
constexpr std::size_t kMostVariations = 64;

/// Visitor that lists numbers, or sets one. Lists count as numbers "key[i]".
class Numbers {
 public:
  Numbers(std::string key, double value) : key_(std::move(key)), value_(value) {}
  std::vector<EffectNumber> met;

  template <class D>
  void quantity(const char* name, Quantity<D>& value, Unit<D> unit, Bounds bounds, const char*) {
    if (meets({std::string{name} + "_" + unit.suffix, value.in(unit), low(bounds), high(bounds)}))
      value = clamped(bounds) * unit;
  }
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void number(const char* name, Number& value, Bounds bounds, const char*) {
    constexpr bool kWhole = std::is_integral_v<Number>;
    if (meets({name, static_cast<double>(value), low(bounds), high(bounds), kWhole,
               kWhole && std::is_unsigned_v<Number>}))
      value = static_cast<Number>(kWhole ? std::round(clamped(bounds)) : clamped(bounds));
  }
  template <class Values>
  void numbers(const char* name, Values& values, Bounds bounds, const char*) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::string key = std::string{name} + "[" + std::to_string(i) + "]";
      if (meets({key, values[i], low(bounds), high(bounds)})) values[i] = clamped(bounds);
    }
  }
  template <class Enum>
  void choice(const char*, Enum&, std::initializer_list<std::pair<const char*, Enum>>, const char*) {}
  void flag(const char*, bool&, const char*) {}
  void text(const char*, std::string&, const char*) {}
  static constexpr bool kSeesNumbersOfTerms = true;

 private:
  static double low(Bounds bounds) { return bounds.min; }
  static double high(Bounds bounds) { return bounds.max; }
  [[nodiscard]] double clamped(Bounds bounds) const { return std::clamp(value_, bounds.min, bounds.max); }
  bool meets(EffectNumber number) {
    const bool is_it = number.key == key_;
    met.push_back(std::move(number));
    return is_it;
  }
  std::string key_;
  double value_;
};

double lengthOf(const std::vector<float>& change) {
  double sum = 0.0;
  for (const float value : change) sum += static_cast<double>(value) * static_cast<double>(value);
  return change.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(change.size()));
}

/// The probe's changes come in turns, range and amplitude: an offset of the one and a gain of the
/// other are free, and are taken out.
std::vector<double> withoutMeans(const std::vector<float>& change) {
  std::vector<double> centred(change.begin(), change.end());
  for (std::size_t channel = 0; channel < 2; ++channel) {
    double sum = 0.0, n = 0.0;
    for (std::size_t i = channel; i < centred.size(); i += 2) sum += centred[i], n += 1.0;
    for (std::size_t i = channel; i < centred.size(); i += 2) centred[i] -= sum / n;
  }
  return centred;
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

/// Changes of range below a micrometre and of amplitude below 1e-5 are rounding.
constexpr double kNothing = 1e-3;

/// Takes a variation in if it shows, and if none so far shows the same (at least the share `least_new` of it
/// must be new); its step is made smaller until the change is small.
struct VariationGatherer {
  const Sensitivity& probe;
  double least_new = kNew;
  std::vector<Variation> kept{};
  std::vector<std::vector<double>> directions{};  ///< of the kept ones, orthonormal

  /// Whether it shows at all.
  bool add(Variation variation, bool may_shrink) {
    std::vector<float> change = probe(variation);
    for (int halvings = 0; may_shrink && !(lengthOf(change) < kTooMuch) && halvings < 20; ++halvings) {
      variation.step *= 0.25;
      const EffectNumber from = numberNamed(variation.off, variation.key);
      variation.on = withNumber(variation.off, variation.key, from.value + variation.step);
      change = probe(variation);
    }
    const double length = lengthOf(change);
    if (!(length > kNothing) || !std::isfinite(length)) return false;
    std::vector<double> rest = withoutMeans(change);
    const double whole = std::sqrt(dot(rest, rest));
    for (const auto& direction : directions) {
      const double along = dot(rest, direction);
      for (std::size_t i = 0; i < rest.size(); ++i) rest[i] -= along * direction[i];
    }
    const double left = std::sqrt(dot(rest, rest));
    const double least =
        kNothing * std::sqrt(static_cast<double>(rest.size()));  // an offset alone is nothing
    if (whole < least || left < least_new * whole || kept.size() >= kMostVariations) return true;
    kept.push_back(std::move(variation));
    if (!(left > 0.0)) return true;
    for (double& value : rest) value /= left;
    directions.push_back(std::move(rest));
    return true;
  }

  static EffectNumber numberNamed(const sim::AnyEffect& effect, const std::string& key) {
    for (EffectNumber& number : numbersOf(effect)) {
      if (number.key == key) return std::move(number);
    }
    return {};
  }
};

/// Values to try of a whole number that chooses something.
std::vector<double> choicesOf(const EffectNumber& number) {
  std::vector<double> values;
  if (number.is_label) return {1.0, 2.0, 3.0, 4.0};
  if (number.high - number.low <= 15.0) {
    for (double value = number.low; value <= number.high; ++value) values.push_back(value);
    return values;
  }
  for (double value = std::max(number.low, std::floor(number.value / 2.0));
       value <= std::min(number.high, 2.0 * number.value); ++value)
    values.push_back(value);
  return values;
}

/// The effect switched off, with each combination of values of its choosing numbers.
std::vector<sim::AnyEffect> choicesOf(const sim::AnyEffect& none, const std::vector<EffectNumber>& choosing) {
  std::vector<sim::AnyEffect> all{none};
  for (const EffectNumber& number : choosing) {
    std::vector<sim::AnyEffect> more;
    for (const sim::AnyEffect& effect : all) {
      for (const double value : choicesOf(number)) more.push_back(withNumber(effect, number.key, value));
    }
    all = std::move(more);
  }
  return all;
}

/// By how much a number is changed that is 0, or the same, in the defaults.
double stepWithin(const EffectNumber& number) {
  const double span = number.high - number.low;
  return number.value + 0.01 * span <= number.high ? 0.01 * span : -0.01 * span;
}

bool isNoise(const sim::AnyEffect& effect) {
  return sim::explainsOf(effect).contains(sim::Covariate::Frame);
}

/// An effect's numbers by what they are for.
struct NumberRoles {
  std::vector<EffectNumber> strengths, others, choosing;
  std::vector<double> typical;  ///< of the strengths, in the defaults
};

NumberRoles numberRolesOf(const sim::AnyEffect& none, const sim::AnyEffect& defaults) {
  NumberRoles roles;
  const auto off = numbersOf(none), on = numbersOf(defaults);
  for (const EffectNumber& number : off) {
    const auto found = std::ranges::find(on, number.key, &EffectNumber::key);
    const double typical = found == on.end() ? number.value : found->value;
    if (typical != number.value)
      roles.strengths.push_back(number), roles.typical.push_back(typical);
    else
      (number.is_whole ? roles.choosing : roles.others).push_back(number);
  }
  // A list that is empty when switched off: its numbers in the defaults are strengths that start at
  // 0.
  for (const EffectNumber& number : on) {
    if (std::ranges::find(off, number.key, &EffectNumber::key) != off.end()) continue;
    roles.strengths.push_back(number), roles.typical.push_back(number.value);
  }
  return roles;
}

/// The defaults with all their strengths at 0, where `none` lacks a list that they have.
sim::AnyEffect quiet(const sim::AnyEffect& none, const sim::AnyEffect& defaults, const NumberRoles& roles) {
  const auto off = numbersOf(none);
  const bool lacks = std::ranges::any_of(roles.strengths, [&](const EffectNumber& number) {
    return std::ranges::find(off, number.key, &EffectNumber::key) == off.end();
  });
  if (!lacks) return none;
  sim::AnyEffect effect = defaults;
  for (const EffectNumber& number : roles.strengths) effect = withNumber(effect, number.key, 0.0);
  return effect;
}

void addStrength(VariationGatherer& gatherer, const sim::AnyEffect& off, const EffectNumber& strength,
                 double typical, const std::vector<EffectNumber>& shapes) {
  // A list's number that is 0 in the defaults is as good as its neighbours.
  const double from = VariationGatherer::numberNamed(off, strength.key).value;
  double step = typical - from;
  if (step == 0.0) step = 1.0;
  const auto add = [&](const sim::AnyEffect& base) {
    gatherer.add({base, withNumber(base, strength.key, from + step), strength.key, step}, !strength.is_whole);
  };
  add(off);
  for (const EffectNumber& shape : shapes) {
    for (const double factor : {1.0 / 3.0, 3.0}) {
      const double value = factor * shape.value;
      if (shape.value > 0.0 && value >= shape.low && value <= shape.high)
        add(withNumber(off, shape.key, value));
    }
  }
}

/// Whether both have the same kind and are at the same place.
bool isAtPlaceOf(const sim::AnyEffect& one, const sim::AnyEffect& other,
                 const std::vector<EffectNumber>& choosing) {
  return one.index() == other.index() && std::ranges::all_of(choosing, [&](const EffectNumber& number) {
           return VariationGatherer::numberNamed(one, number.key).value ==
                  VariationGatherer::numberNamed(other, number.key).value;
         });
}

/// `declared`: what it does at their places is said already.
Candidate candidateOf(const sim::AnyEffect& none, const sim::AnyEffect& defaults,
                      const std::vector<sim::AnyEffect>& declared, const Sensitivity& probe) {
  Candidate candidate{defaults};
  const NumberRoles roles = numberRolesOf(none, defaults);
  VariationGatherer gatherer{probe};
  auto choices = choicesOf(quiet(none, defaults, roles), roles.choosing);
  const auto free = std::ranges::stable_partition(choices, [&](const sim::AnyEffect& off) {
    return std::ranges::any_of(declared,
                               [&](const auto& one) { return isAtPlaceOf(off, one, roles.choosing); });
  });
  for (const sim::AnyEffect& off : choices) {
    if (&off == free.data()) gatherer.kept.clear();
    std::vector<EffectNumber> shapes;
    for (const EffectNumber& other : roles.others) {
      const double step = stepWithin(other);
      const Variation alone{off, withNumber(off, other.key, other.value + step), other.key, step};
      if (gatherer.add(alone, true)) {
        if (std::ranges::count(candidate.strengths, other.key) == 0) candidate.strengths.push_back(other.key);
      } else {
        shapes.push_back(other);  // does nothing by itself
      }
    }
    for (std::size_t i = 0; i < roles.strengths.size(); ++i)
      addStrength(gatherer, off, roles.strengths[i], roles.typical[i], shapes);
  }
  for (const EffectNumber& strength : roles.strengths) candidate.strengths.push_back(strength.key);
  candidate.variations = std::move(gatherer.kept);
  return candidate;
}

}  // namespace

std::vector<EffectNumber> numbersOf(const sim::AnyEffect& effect) {
  sim::AnyEffect copy = effect;
  Numbers numbers{"", 0.0};
  std::visit([&](auto& one) { one.visit(numbers); }, copy);
  return std::move(numbers.met);
}

sim::AnyEffect withNumber(const sim::AnyEffect& effect, const std::string& key, double value) {
  sim::AnyEffect copy = effect;
  Numbers numbers{key, value};
  std::visit([&](auto& one) { one.visit(numbers); }, copy);
  return copy;
}

sim::AnyEffect noneOf(const sim::AnyEffect& effect) {
  return std::visit([]<class E>(const E&) { return sim::AnyEffect{E::none()}; }, effect);
}

sim::AnyEffect defaultsOf(const sim::AnyEffect& effect) {
  return std::visit([]<class E>(const E&) { return sim::AnyEffect{E{}}; }, effect);
}

bool isStrength(const sim::AnyEffect& effect, const std::string& key) {
  const NumberRoles roles = numberRolesOf(noneOf(effect), defaultsOf(effect));
  if (std::ranges::find(roles.strengths, key, &EffectNumber::key) != roles.strengths.end()) return true;
  // A list may be longer than in the defaults.
  return key.ends_with("]") && std::ranges::any_of(roles.strengths, [&](const EffectNumber& number) {
           return number.key.substr(0, number.key.find('[')) == key.substr(0, key.find('['));
         });
}

std::string nameOf(const sim::AnyEffect& effect) {
  return std::visit([]<class E>(const E&) { return std::string{E::about.name}; }, effect);
}

Stage stageOf(const sim::AnyEffect& effect) {
  const terms::Stage stage = sim::stageOf(effect);
  return stage == terms::Stage::Light ? Stage::Light : stage == terms::Stage::Samples ? Stage::Samples : Stage::Range;
}

std::vector<std::string> covariatesOf(const sim::AnyEffect& effect) {
  std::vector<std::string> words;
  const sim::Covariates on = sim::explainsOf(effect);
  for (const auto& [covariate, word] : sim::kCovariateNames) {
    if (on.contains(covariate)) words.emplace_back(word);
  }
  return words;
}

std::size_t placeOf(const sim::AnyEffect& effect) {
  const auto behind = [](const sim::AnyEffect& other) { return 2 * other.index() + 1; };
  if (!std::holds_alternative<sim::Learned>(effect)) return 2 * effect.index();
  // What has no name yet comes behind the optics, the converter, the decoding: before what filters.
  if (sim::actsOn<sim::Light>(effect)) return behind(sim::InternalReflection{});
  return sim::actsOn<sim::Samples>(effect) ? behind(sim::ColumnComb{}) : behind(sim::CalibrationTable{});
}

std::vector<sim::AnyEffect> withInserted(std::vector<sim::AnyEffect> effects, const sim::AnyEffect& effect) {
  const auto behind = std::ranges::find_if(
      effects, [&](const sim::AnyEffect& other) { return placeOf(other) > placeOf(effect); });
  effects.insert(behind, effect);
  return effects;
}

bool choosesAPlace(const sim::AnyEffect& effect) {
  const NumberRoles roles = numberRolesOf(noneOf(effect), defaultsOf(effect));
  return !roles.choosing.empty() && std::ranges::none_of(roles.choosing, &EffectNumber::is_label);
}

std::string placeInWords(const sim::AnyEffect& effect) {
  if (!choosesAPlace(effect)) return "";
  std::string words;
  for (const EffectNumber& number : numbersOf(effect))
    if (number.is_whole && !isStrength(effect, number.key))
      words +=
          (words.empty() ? "" : ", ") + number.key + " " + std::to_string(static_cast<long>(number.value));
  return words;
}

std::vector<Candidate> candidatesOf(const Sensitivity& probe, const std::vector<sim::AnyEffect>& declared,
                                    const std::vector<std::string>& left_out) {
  std::vector<Candidate> all;
  sim::AllEffects::forEach([&]<class E>() {
    const sim::AnyEffect defaults{E{}};
    const bool is_declared = std::ranges::any_of(
        declared, [](const sim::AnyEffect& one) { return std::holds_alternative<E>(one); });
    const bool is_left_out = std::ranges::find(left_out, E::about.name) != left_out.end() ||
                             (is_declared && !choosesAPlace(defaults));
    // What was learned from data without a name is no explanation of other data.
    if (is_left_out || isNoise(defaults) || std::is_same_v<E, sim::Learned>) return;
    Candidate candidate = candidateOf(sim::AnyEffect{E::none()}, defaults, declared, probe);
    if (!candidate.variations.empty()) all.push_back(std::move(candidate));
  });
  return all;
}

Candidate declaredCandidate(const sim::AnyEffect& effect, const Sensitivity& probe) {
  Candidate candidate{effect};
  if (isNoise(effect)) return candidate;
  // All that the file's numbers can do is free, also what the few captures that are probed do not tell apart:
  // of two drifts that begin and end together they show one.
  VariationGatherer gatherer{probe, 0.0};
  for (const EffectNumber& number : numbersOf(effect)) {
    if (number.is_whole) continue;
    double step = number.value != 0.0 ? 0.1 * number.value : stepWithin(number);
    if (number.value + step > number.high || number.value + step < number.low) step = -step;
    gatherer.add({effect, withNumber(effect, number.key, number.value + step), number.key, step}, true);
  }
  candidate.variations = std::move(gatherer.kept);
  return candidate;
}

}  // namespace toftwin::discover
