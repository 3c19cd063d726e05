// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/found_effects.h"

#include <algorithm>

#include "calib/discover/estimate.h"

namespace toftwin::discover {
namespace {

std::shared_ptr<const RowSource> sourceWith(const Context& context,
                                            const std::vector<std::shared_ptr<const NamedFit>>& fits) {
  if (fits.empty()) return context.original;
  std::vector<const NamedFit*> plain;
  for (const auto& fit : fits) plain.push_back(fit.get());
  return context.original->named()->including(plain, true);
}

}  // namespace

void include(Found& found) {
  found.context.included = fitsOf(found.effects);
  found.context.source = sourceWith(found.context, found.context.included);
}

std::vector<std::shared_ptr<const NamedFit>> fitsOf(const std::vector<Effect>& effects) {
  std::vector<std::shared_ptr<const NamedFit>> fits;
  for (const Effect& effect : effects)
    if (effect.fit) fits.push_back(effect.fit);
  return fits;
}

std::shared_ptr<const RowSource> sourceOf(const Context& context,
                                          const std::vector<std::shared_ptr<const NamedFit>>& some) {
  return some.size() == context.included.size() ? context.source : sourceWith(context, some);
}

Context knowingOnly(const Found& found, const std::vector<Effect>& effects) {
  Context context = found.context;
  context.known = groupsOf(effects);
  for (TermGroup& tangent : tangentsOf(effects)) context.known.push_back(std::move(tangent));
  return context;
}

void settle(Found& found, Effect& effect) {
  for (FittedForm& part : effect.parts) {
    for (Term& term : part.group.terms) {
      const std::string carrier = term.carrier;
      term = found.context.source->settled(std::move(term));
      if (term.carrier == carrier) continue;
      std::erase_if(found.context.generic, [&](const TermGroup& group) {
        return !group.terms.empty() && group.terms.front().carrier == carrier;
      });
    }
  }
}

std::optional<std::size_t> chosenOf(const Context& context, std::vector<Explanation>& explanations) {
  fitCatalogue(context, explanations);
  if (const auto named = chooseNamed(context, explanations)) return named;
  return choose(explanations);
}

Evidence evidenceOf(const Context& context, std::span<const TermGroup> extra) {
  return context.catalogue.empty() ? context.source->withoutCatalogue(extra)
                                   : context.source->evidence(extra);
}

Gain gainBeside(const Found& found, std::size_t which) {
  std::vector<Effect> others = found.effects;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(which));
  Context beside = found.context;
  beside.known = groupsOf(others);
  auto fits = fitsOf(others);
  beside.source = sourceOf(found.context, fits);
  const Effect& effect = found.effects[which];
  if (effect.fit) {
    const auto left = [&](const RowSource& source) {
      const Marginal marginal = marginalise(source.withoutCatalogue(beside.known), beside.scales);
      return heldOut(marginal, modelOf(beside, marginal, beside.known.size()));
    };
    const auto before = left(*beside.source);
    fits.push_back(effect.fit);
    return gainOf(before, left(*sourceOf(found.context, fits)));
  }
  std::vector<TermGroup> extra = beside.known;
  extra.push_back({"this", Kind::Generic, termsOf(effect), 0});
  const Marginal marginal = marginalise(evidenceOf(beside, extra), beside.scales);
  return crossValidate(marginal, modelOf(beside, marginal, extra.size()), {marginal.groups.size() - 1})
      .front();
}

}  // namespace toftwin::discover
