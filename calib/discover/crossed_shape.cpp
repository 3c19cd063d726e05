// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/crossed_shape.h"

#include <algorithm>
#include <iterator>
#include <tuple>

#include "calib/discover/candidates.h"
#include "calib/discover/light_shape.h"

namespace toftwin::discover {
namespace {

constexpr std::size_t kMostTerms = 16;  ///< of a curve that is crossed
constexpr std::size_t kTermsOfAFormula = 2;  ///< at most: what has more is a series of waves

/// Of one covariate of the camera's or the scene's; what light does there (a delay, a gain) may be multiplied in.
bool canBeCrossed(const Context& context, const Explanation& one) {
  if (one.is_catalogue || one.fitted.group.terms.size() > kMostTerms) return false;
  const auto known = std::ranges::count_if(
      one.covariates, [&](const std::string& name) { return infoOf(context, name) != nullptr; });
  const bool has_share = std::ranges::any_of(one.covariates, [&](const std::string& name) {
    const CovariateInfo* info = infoOf(context, name);
    return info != nullptr && info->nature == Nature::Share;
  });
  return known == 1 && !has_share && std::ranges::all_of(one.fitted.group.terms,
                                           [](const Term& term) { return term.factors.size() == 1; });
}

bool isStrengthOf(const CovariateInfo& covariate) {
  const auto& spread = covariate.quantiles;
  return !isByItself(covariate) && !spread.empty() &&
         spread.back() > spread.front();
}

/// The curve, and one over the other covariate of the product added to it.
FittedForm withCurveOverTheOther(const Context& context, const FittedForm& one, const Explanation& product) {
  constexpr std::size_t kKnots = 7;
  const TermGroup& own = one.group;
  FittedForm sum;
  sum.group = own;
  sum.group.name = own.name + " plus another";
  const auto known = covariatesOf(own);
  for (const std::string& name : product.covariates) {
    const CovariateInfo* other = std::ranges::count(known, name) > 0 ? nullptr : infoOf(context, name);
    if (other == nullptr) continue;
    for (Term& term : smoothIn(*other, kKnots).terms) {
      term.stage = own.terms.front().stage, term.carrier = own.terms.front().carrier;
      sum.group.terms.push_back(std::move(term));
    }
  }
  return sum;
}

/// What two things explain each by itself is no product, nor what moves the range and dims the light along one.
bool beatsTheSum(const Context& context, const FittedForm& one, const Explanation& product, double enough) {
  std::vector<FittedForm> sums = withItsLight(context, one);
  sums.push_back(withCurveOverTheOther(context, one, product));
  return std::ranges::all_of(judged(context, std::move(sums)), [&](const Explanation& sum) {
    return isMoreBy(enough, product.gain, sum.gain);
  });
}

}  // namespace

std::optional<std::size_t> crossedShape(const Context& context, std::vector<Explanation>& all, std::size_t chosen) {
  if (!canBeCrossed(context, all[chosen])) return std::nullopt;
  const Explanation one = all[chosen];
  std::vector<FittedForm> forms;
  for (const CovariateInfo& other : context.covariates) {
    if (!isStrengthOf(other) || std::ranges::count(one.covariates, other.name) > 0) continue;
    for (FittedForm& form : crossedWith(one.fitted, other)) forms.push_back(std::move(form));
  }
  std::vector<Explanation> crossed = judged(context, std::move(forms));
  const auto best = std::ranges::max_element(crossed, {}, [](const Explanation& e) { return e.gain.total; });
  if (best == crossed.end()) return std::nullopt;
  // What is as good uncrossed is told uncrossed. A curve, the first waves of a series, and what light does to first
  // order are right to some per cent; and the best of many is better than it is.
  const bool is_exact = one.fitted.form.build != nullptr && one.fitted.group.terms.size() <= kTermsOfAFormula;
  const double shape = (is_exact ? 0.02 : 0.05) * best->gain.total;
  const double enough = std::max(luckOfTheBestOf(crossed.size()), shape);
  const auto isMore = [&](const Explanation& e) { return isMoreBy(enough, e.gain, one.gain); };
  if (!isMore(*best)) return std::nullopt;
  // Of those that are not told from the best, the one with the fewest numbers.
  const auto isWorse = [&](const Explanation& e) {
    return !isMore(e) || best->gain.total - e.gain.total > difference(best->gain, e.gain).error;
  };
  const auto simplest = std::ranges::min_element(crossed, {}, [&](const Explanation& e) {
    return std::tuple{isWorse(e), e.numbers, -e.gain.total};
  });
  if (!beatsTheSum(context, one.fitted, *simplest, enough)) return std::nullopt;
  const std::size_t place = all.size() + static_cast<std::size_t>(simplest - crossed.begin());
  all.insert(all.end(), std::make_move_iterator(crossed.begin()), std::make_move_iterator(crossed.end()));
  return place;
}

}  // namespace toftwin::discover
