// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/reshape_effects.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "calib/discover/estimate.h"

namespace toftwin::discover {
namespace {

std::vector<Effect> othersThan(const Found& found, const Effect& effect) {
  std::vector<Effect> others;
  for (const Effect& one : found.effects)
    if (&one != &effect) others.push_back(one);
  return others;
}

Effect partOf(FittedForm form) {
  Effect part;
  part.name = form.group.name, part.covariates = covariatesOf(form.group), part.stage = form.group.terms.front().stage;
  part.parts.push_back(std::move(form));
  return part;
}

void addPart(Effect& effect, const Effect& more) {
  const bool is_first = effect.parts.empty();
  effect.parts.insert(effect.parts.end(), more.parts.begin(), more.parts.end());
  for (const std::string& name : more.covariates)
    if (std::ranges::count(effect.covariates, name) == 0) effect.covariates.push_back(name);
  std::ranges::sort(effect.covariates);
  // No effect on ranges changes amplitudes.
  if (effect.stage != more.stage) effect.stage = Stage::Light;
  const std::string along = fmt::format("{}", fmt::join(effect.covariates, " and "));
  effect.name = is_first             ? more.name
                : isFormula(effect) ? effect.name + " + " + more.name
                                     : "smooth in " + along;
}

/// Of the terms of all these parts together, less what their inner numbers cost.
Gain gainOfParts(const Context& without, const std::vector<FittedForm>& parts) {
  TermGroup sum{"sum", Kind::Generic, {}, 0};
  for (const FittedForm& part : parts)
    sum.terms.insert(sum.terms.end(), part.group.terms.begin(), part.group.terms.end());
  std::vector<TermGroup> extra = without.known;
  extra.push_back(std::move(sum));
  const Marginal marginal = marginalise(evidenceOf(without, extra), without.scales);
  const Columns model = modelOf(without, marginal, extra.size());
  Gain gain = crossValidate(marginal, model, {marginal.groups.size() - 1}).front();
  for (const FittedForm& part : parts)
    for (const Inner& inner : part.form.inner) gain.total -= inner.price;
  return gain;
}

Gain gainOfSum(const Context& without, const Effect& effect, const Effect& more) {
  std::vector<FittedForm> parts = effect.parts;
  parts.insert(parts.end(), more.parts.begin(), more.parts.end());
  return gainOfParts(without, parts);
}

/// What stays at each pixel was learned from all captures, those that are held out, too: it says nothing of others.
bool mayGo(const Context& without, const FittedForm& part) {
  return std::ranges::all_of(part.group.terms,
                             [&](const Term& term) { return without.source->errorFactor(term) == 1.0; });
}

/// The part without which the others predict other captures as `all` do; of several the one that they miss least.
std::optional<std::size_t> needlessPart(const Context& without, const std::vector<FittedForm>& parts,
                                        const Gain& all) {
  if (parts.size() < 2 || !std::ranges::all_of(parts, [&](const FittedForm& part) { return mayGo(without, part); }))
    return std::nullopt;
  std::optional<std::size_t> needless;
  double most = 0.0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    std::vector<FittedForm> others = parts;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    const Gain less = gainOfParts(without, others);
    if (isMoreBy(0.0, all, less) || (needless && less.total <= most)) continue;
    needless = i, most = less.total;
  }
  return needless;
}

/// What was said of it was said of parts that are gone.
void tellAgain(Found& found, const Context& without, Effect& effect) {
  if (effect.parts.size() == 1) {
    const auto explanations = competeFor(without, effect.covariates);
    if (const auto chosen = choose(explanations)) {
      Effect again = effectOf(without, explanations, *chosen);
      settle(found, again);
      again.p = effect.p;
      effect = std::move(again);
      return;
    }
  }
  const Gain gain = gainOfParts(without, effect.parts);
  effect.gain = against0(gain), effect.gain.mean = gain.total, effect.predicts = holds(gain);
  effect.tried.clear(), effect.alternatives.clear(), effect.experiment.reset();
}

}  // namespace

void reshape(Found& found, Effect& effect, const Effect& more) {
  if (effect.covariates != more.covariates) return addPart(effect, more);
  const Context without = knowingOnly(found, othersThan(found, effect));
  auto explanations = competeFor(without, effect.covariates);
  const Gain both = gainOfSum(without, effect, more);
  const auto chosen = choose(explanations);
  if (chosen) {
    const Difference worse = difference(both, explanations[*chosen].gain);
    if (both.total - explanations[*chosen].gain.total < worse.error) {
      Effect again = effectOf(without, explanations, *chosen);
      settle(found, again);
      again.p = effect.p;
      effect = std::move(again);
      return;
    }
  }
  addPart(effect, more);
}

void dropNeedlessParts(Found& found) {
  for (Effect& effect : found.effects) {
    if (effect.parts.size() < 2) continue;
    const Context without = knowingOnly(found, othersThan(found, effect));
    const Gain all = gainOfParts(without, effect.parts);
    const std::size_t before = effect.parts.size();
    while (const auto needless = needlessPart(without, effect.parts, all)) {
      std::vector<FittedForm> parts = std::move(effect.parts);
      parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(*needless));
      effect.parts.clear(), effect.covariates.clear(), effect.stage = parts.front().group.terms.front().stage;
      for (FittedForm& part : parts) addPart(effect, partOf(std::move(part)));
    }
    if (effect.parts.size() < before) tellAgain(found, without, effect);
  }
}

void revise(Found& found) {
  for (Effect& effect : found.effects) {
    if (effect.is_catalogue || effect.parts.size() != 1) continue;
    const std::vector<Effect> others = othersThan(found, effect);
    const Context without = knowingOnly(found, others);
    // What else it could be, too: until now the other effects were among its rivals.
    std::erase_if(effect.alternatives, [&](const Alternative& other) {
      return std::ranges::find(others, other.covariates, &Effect::covariates) != others.end();
    });
    if (effect.alternatives.empty()) effect.experiment.reset();
    auto explanations = compete(without);
    const auto chosen = chosenOf(without, explanations);
    if (!chosen) continue;
    const Explanation& now = explanations[*chosen];
    // Of a table it may turn out to go with something else: what it was found by stood in for an effect not known yet.
    const bool may_move = found.context.original->named() == nullptr &&
                          std::ranges::find(others, now.covariates, &Effect::covariates) == others.end();
    if (now.is_catalogue ? !now.named : now.covariates != effect.covariates && !may_move) continue;
    Effect again = effectOf(without, explanations, *chosen);
    settle(found, again);
    again.p = effect.p;
    effect = std::move(again);
    if (effect.fit) include(found);
  }
}

bool retellUndetermined(Found& found) {
  bool is_any = false;
  for (Effect& effect : found.effects) {
    if (effect.is_catalogue || effect.parts.size() != 1 || effect.numbers.empty()) continue;
    const bool has_one = effect.parts[0].group.terms.size() == 1 && !effect.parts[0].form.inner.empty();
    if (!has_one || std::abs(effect.numbers[0].value) >= 2.0 * effect.numbers[0].error) continue;
    const Context without = knowingOnly(found, othersThan(found, effect));
    auto explanations = competeFor(without, effect.covariates);
    std::erase_if(explanations, [](const Explanation& one) { return !one.fitted.form.inner.empty(); });
    const auto chosen = choose(explanations);
    if (!chosen) continue;
    Effect again = effectOf(without, explanations, *chosen);
    settle(found, again);
    again.p = effect.p;
    effect = std::move(again);
    is_any = true;
  }
  return is_any;
}

void prune(Found& found) {
  while (found.effects.size() > 1) {
    std::size_t least = found.effects.size();
    double smallest = 2.0;
    for (std::size_t i = 0; i < found.effects.size(); ++i) {
      if (found.effects[i].is_catalogue && !found.effects[i].fit) continue;
      const Difference gain = against0(gainBeside(found, i));
      const double z = gain.mean / std::max(gain.error, 1e-9);
      if (gain.mean < 4.0 || z < smallest) smallest = std::min(z, smallest), least = i;
    }
    if (least == found.effects.size()) return;
    found.effects.erase(found.effects.begin() + static_cast<std::ptrdiff_t>(least));
    include(found);
  }
}

}  // namespace toftwin::discover
