// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/light_shape.h"

#include <algorithm>
#include <string>

#include <fmt/format.h>

namespace toftwin::discover {
namespace {

/// What light does along each of these covariates, by the curves that are looked for along one.
std::vector<std::string> carriersAlongAll(const Context& context, const std::vector<std::string>& covariates) {
  const auto isAlong = [&](const TermGroup& group, const std::string& carrier, const std::string& covariate) {
    return !group.terms.empty() && std::ranges::all_of(group.terms, [&](const Term& term) {
      return term.carrier == carrier && term.stage == Stage::Light && term.factors.size() == 1 &&
             term.factors.front().covariate == covariate;
    });
  };
  std::vector<std::string> carriers;
  for (const TermGroup& group : context.generic) {
    const std::string carrier = group.terms.empty() ? "" : group.terms.front().carrier;
    if (carrier.empty() || std::ranges::count(carriers, carrier) > 0) continue;
    const bool is_along_all = std::ranges::all_of(covariates, [&](const std::string& covariate) {
      return std::ranges::any_of(context.generic,
                                 [&](const TermGroup& other) { return isAlong(other, carrier, covariate); });
    });
    if (is_along_all) carriers.push_back(carrier);
  }
  return carriers;
}

FittedForm ofTheLight(FittedForm fitted, const std::string& carrier) {
  fitted.form.stage = Stage::Light, fitted.form.carrier = carrier;
  fitted.form.name = fmt::format("{}: {}", carrier, fitted.form.name);
  fitted.group.name = fmt::format("{}: {}", carrier, fitted.group.name);
  for (Term& term : fitted.group.terms) term.stage = Stage::Light, term.carrier = carrier;
  return fitted;
}

/// An error of the range, as whatever is made of it.
bool isOfTheRange(const Explanation& one) { return !one.is_catalogue && !one.is_sum && one.carrier().empty(); }

/// The best along that covariate alone.
std::optional<std::size_t> bestAlong(const std::vector<Explanation>& all, const std::string& covariate) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!isOfTheRange(all[i]) || all[i].covariates != std::vector{covariate}) continue;
    if (!best || all[i].gain.total > all[*best].gain.total) best = i;
  }
  return best;
}

}  // namespace

std::vector<FittedForm> withItsLight(const Context& context, const FittedForm& fitted) {
  std::vector<FittedForm> all;
  for (const std::string& carrier : carriersAlongAll(context, covariatesOf(fitted.group))) {
    FittedForm both = fitted;
    for (Term& term : ofTheLight(fitted, carrier).group.terms) both.group.terms.push_back(std::move(term));
    all.push_back(std::move(both));
  }
  return all;
}

std::optional<std::size_t> lightShape(const Context& context, std::vector<Explanation>& all, std::size_t chosen) {
  if (!isOfTheRange(all[chosen]) || all[chosen].covariates.size() < 2) return std::nullopt;
  std::vector<FittedForm> forms{all[chosen].fitted};  // judged on the same folds
  for (const std::string& carrier : carriersAlongAll(context, all[chosen].covariates))
    forms.push_back(ofTheLight(all[chosen].fitted, carrier));
  if (forms.size() == 1) return std::nullopt;
  std::vector<Explanation> judged_forms = judged(context, std::move(forms));
  const auto best = std::max_element(judged_forms.begin() + 1, judged_forms.end(), [](const auto& a, const auto& b) {
    return a.gain.total < b.gain.total;
  });
  if (!isMoreBy(luckOfTheBestOf(judged_forms.size() - 1), best->gain, judged_forms.front().gain)) return std::nullopt;
  all.push_back(std::move(*best));
  return all.size() - 1;
}

std::optional<std::size_t> alongOne(const Context& context, const std::vector<Explanation>& all, std::size_t chosen) {
  if (!isOfTheRange(all[chosen]) || all[chosen].covariates.size() != 2) return std::nullopt;
  std::vector<FittedForm> forms{all[chosen].fitted};  // judged on the same folds
  std::vector<std::size_t> curves{chosen};
  for (const std::string& covariate : all[chosen].covariates) {
    const auto curve = bestAlong(all, covariate);
    if (!curve) continue;
    for (FittedForm& both : withItsLight(context, all[*curve].fitted))
      forms.push_back(std::move(both)), curves.push_back(*curve);
  }
  if (forms.size() == 1) return std::nullopt;
  const std::vector<Explanation> judged_forms = judged(context, std::move(forms));
  const auto best = std::max_element(judged_forms.begin() + 1, judged_forms.end(), [](const auto& a, const auto& b) {
    return a.gain.total < b.gain.total;
  });
  if (isMoreThanParts(judged_forms.front().gain, best->gain)) return std::nullopt;
  return curves[static_cast<std::size_t>(best - judged_forms.begin())];
}

}  // namespace toftwin::discover
