// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/light_shape.h"

#include <algorithm>
#include <string>

#include <fmt/format.h>

namespace toftwin::discover {
namespace {

/// What light does along each of these covariates, by the curves that are looked for along one.
std::vector<std::string> carriersAlongAll(const Context& context, const std::vector<std::string>& covariates) {
  std::vector<std::string> carriers;
  for (const TermGroup& group : context.generic) {
    const std::string carrier = group.terms.empty() ? "" : group.terms.front().carrier;
    if (carrier.empty() || std::ranges::count(carriers, carrier) > 0) continue;
    const bool is_along_all = std::ranges::all_of(covariates, [&](const std::string& covariate) {
      std::vector<std::string> along{covariate, carrier};
      std::ranges::sort(along);
      return std::ranges::any_of(carriersAlong(context, along), [&](const Term* term) {
        return term->carrier == carrier && term->stage == Stage::Light;
      });
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

/// Of forms that were judged together, the first is what the others are compared with.
std::size_t bestOfTheOthers(const std::vector<Explanation>& all) {
  const auto best = std::max_element(all.begin() + 1, all.end(), [](const Explanation& a, const Explanation& b) {
    return a.gain.total < b.gain.total;
  });
  return static_cast<std::size_t>(best - all.begin());
}

/// Of what goes along that covariate, by itself or times the carrier, what is to be told.
std::optional<std::size_t> toldAlong(const std::vector<Explanation>& all, const std::string& covariate,
                                     const std::string& carrier) {
  std::vector<Explanation> some;
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string its = all[i].carrier();
    if (all[i].is_catalogue || all[i].is_sum || !(its.empty() || its == carrier)) continue;
    const bool is_along = std::ranges::all_of(all[i].covariates, [&](const std::string& name) {
      return name == covariate || name == carrier;
    });
    if (is_along && holds(all[i].gain)) some.push_back(all[i]), places.push_back(i);
  }
  const auto chosen = choose(some);
  return chosen ? std::optional{places[*chosen]} : std::nullopt;
}

}  // namespace

std::vector<FittedForm> withItsLight(const Context& context, const FittedForm& fitted) {
  std::vector<FittedForm> all;
  for (const std::string& carrier : carriersAlongAll(context, covariatesOf(fitted.group))) {
    FittedForm both = fitted;
    both.form.build = nullptr;  // which would make its first half alone
    both.group.name = fmt::format("{}, and as a {}", fitted.group.name, carrier);
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
  const std::size_t best = bestOfTheOthers(judged_forms);
  const double luck = luckOfTheBestOf(judged_forms.size() - 1);
  if (!isMoreBy(luck, judged_forms[best].gain, judged_forms.front().gain)) return std::nullopt;
  all.push_back(std::move(judged_forms[best]));
  return all.size() - 1;
}

std::optional<std::size_t> alongOne(const Context& context, const std::vector<Explanation>& all, std::size_t chosen) {
  if (!isOfTheRange(all[chosen]) || all[chosen].covariates.size() != 2) return std::nullopt;
  struct Along {
    std::string covariate, carrier;
  };
  std::vector<FittedForm> forms{all[chosen].fitted};  // judged on the same folds
  std::vector<Along> along{{}};
  for (const Explanation& one : all) {
    const bool is_of_one = one.covariates.size() == 1 &&
                           std::ranges::count(all[chosen].covariates, one.covariates.front()) > 0;
    if (!is_of_one || !isOfTheRange(one)) continue;
    for (FittedForm& both : withItsLight(context, one.fitted)) {
      along.push_back({one.covariates.front(), both.group.terms.back().carrier});
      forms.push_back(std::move(both));
    }
  }
  if (forms.size() == 1) return std::nullopt;
  const std::vector<Explanation> judged_forms = judged(context, std::move(forms));
  const std::size_t best = bestOfTheOthers(judged_forms);
  if (isMoreBy(luckOfTheBestOf(all.size()), judged_forms.front().gain, judged_forms[best].gain)) return std::nullopt;
  return toldAlong(all, along[best].covariate, along[best].carrier);
}

}  // namespace toftwin::discover
