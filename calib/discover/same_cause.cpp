// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/same_cause.h"

#include <algorithm>
#include <set>
#include <string>

#include "calib/discover/estimate.h"

namespace toftwin::discover {
namespace {

/// The covariates along which it goes, without what light does there: what moves the range and dims the light
/// along the same covariate is one effect.
std::vector<std::string> alongOf(const Context& context, const Effect& effect) {
  std::vector<std::string> along;
  for (const std::string& name : effect.covariates)
    if (infoOf(context, name) != nullptr) along.push_back(name);
  return along.empty() ? effect.covariates : along;
}

/// As far as it says along what it goes.
Effect effectLike(const Alternative& other) { return {.name = other.name, .covariates = other.covariates}; }

/// What effects of the catalogue call that along which it goes.
std::set<std::string> wordsOf(const Context& context, const Effect& effect) {
  std::set<std::string> words;
  for (const std::string& name : alongOf(context, effect)) {
    const CovariateInfo* info = infoOf(context, name);
    words.insert(info != nullptr ? info->word : context.source->wordOfCarrier(name));
  }
  return words;
}

bool isOfLight(const Effect& effect) {
  return std::ranges::any_of(termsOf(effect), [](const Term& term) { return !term.carrier.empty(); });
}

bool mayBeUndeclared(const Effect& effect) {
  return !effect.is_catalogue || std::ranges::any_of(effect.alternatives, [](const Alternative& other) {
    return !other.group.terms.empty();
  });
}

/// A curve, what light does to first order, or a name that is not certain.
bool isApproximate(const Effect& effect) {
  return effect.is_catalogue ? mayBeUndeclared(effect) : !isFormula(effect) || isOfLight(effect);
}

/// Its terms; of an effect of the catalogue those of the curve that it is not told from.
TermGroup curveOf(const Effect& effect) {
  TermGroup curve{effect.name, Kind::Generic, termsOf(effect), 0};
  for (const Alternative& other : effect.alternatives)
    if (curve.terms.empty()) curve = other.group;
  return curve;
}

/// Whether much of the weaker one's curve is the stronger one's, too, whatever its sign: more of it, ρ², than
/// covariates that have nothing to do with each other have over so many captures, |ρ| > 2/√n. What has a
/// cause of its own goes its own way.
bool shareAPart(const Found& found, std::size_t weaker, std::size_t stronger) {
  std::vector<Effect> others;
  for (std::size_t i = 0; i < found.effects.size(); ++i)
    if (i != weaker && i != stronger) others.push_back(found.effects[i]);
  Context beside = found.context;
  beside.known = groupsOf(others);
  beside.source = sourceOf(found.context, fitsOf(others));
  const double shared =
      correlationOf(beside, curveOf(found.effects[weaker]), curveOf(found.effects[stronger]));
  const auto captures = static_cast<double>(beside.source->withoutCatalogue({}).captures.size());
  return shared * shared * captures > 4.0;
}

}  // namespace

bool goAlongTheSame(const Context& context, const Effect& a, const Effect& b) {
  const auto along_a = alongOf(context, a), along_b = alongOf(context, b);
  if (along_a == along_b) return true;
  const auto isCarrier = [&](const std::vector<std::string>& along) {
    return std::ranges::all_of(along,
                               [&](const std::string& name) { return infoOf(context, name) == nullptr; });
  };
  return (isCarrier(along_a) || isCarrier(along_b)) && !wordsOf(context, a).contains("") &&
         wordsOf(context, a) == wordsOf(context, b);
}

std::optional<std::size_t> partOfAKnown(const Found& found, const std::vector<Explanation>& explanations,
                                        const Effect& effect) {
  const auto isMoreOfAKnown = [&](const Alternative& other) {
    return std::ranges::any_of(found.effects, [&](const Effect& known) {
      return !known.is_catalogue && isApproximate(known) &&
             goAlongTheSame(found.context, known, effectLike(other));
    });
  };
  for (const Alternative& other : effect.alternatives) {  // the best first
    if (other.group.terms.empty() || !isMoreOfAKnown(other)) continue;
    const auto place = std::ranges::find_if(explanations, [&](const Explanation& one) {
      return !one.is_catalogue && one.name == other.name && one.covariates == other.covariates;
    });
    if (place != explanations.end()) return static_cast<std::size_t>(place - explanations.begin());
  }
  return std::nullopt;
}

std::optional<std::size_t> nameInDoubt(const Found& found, const Effect& effect) {
  const auto goesAlong = [&](const Effect& curve) {
    return (!effect.is_catalogue && goAlongTheSame(found.context, curve, effect)) ||
           std::ranges::any_of(effect.alternatives, [&](const Alternative& other) {
             return !other.group.terms.empty() &&
                    goAlongTheSame(found.context, curve, effectLike(other));
           });
  };
  for (std::size_t i = 0; i < found.effects.size(); ++i) {
    if (!found.effects[i].fit) continue;
    for (const Alternative& other : found.effects[i].alternatives) {
      if (other.group.terms.empty()) continue;
      if (goesAlong(effectLike(other))) return i;
    }
  }
  return std::nullopt;
}

bool isWhatACurveLeaves(const Found& found, const Effect& effect) {
  constexpr double kKnown = 0.05;
  constexpr double kTwentiethOfItsSize = 0.0025;
  const bool is_certain = effect.alternatives.empty() && (effect.is_catalogue || isFormula(effect));
  return std::ranges::any_of(found.effects, [&](const Effect& known) {
    if (known.fit) return !is_certain && effect.gain.mean < kTwentiethOfItsSize * known.gain.mean;
    return !known.is_catalogue && isApproximate(known) &&
           alongOf(found.context, known) != alongOf(found.context, effect) &&
           effect.gain.mean < kKnown * known.gain.mean;
  });
}

void markRests(Found& found) {
  std::vector<double> gains;
  for (std::size_t i = 0; i < found.effects.size(); ++i) {
    const Effect& effect = found.effects[i];
    gains.push_back(effect.is_catalogue && !effect.fit ? effect.gain.mean : gainBeside(found, i).total);
  }
  for (std::size_t i = 0; i < gains.size(); ++i) {
    for (std::size_t k = 0; k < gains.size(); ++k) {
      if (i == k || !mayBeUndeclared(found.effects[i]) || !isApproximate(found.effects[k])) continue;
      if (gains[i] < kRest * gains[k] && shareAPart(found, i, k)) found.effects[i].is_rest = true;
    }
  }
  std::ranges::stable_sort(found.effects, {}, &Effect::is_rest);  // behind what they are the rest of
}

}  // namespace toftwin::discover
