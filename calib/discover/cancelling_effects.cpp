// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/cancelling_effects.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include <fmt/format.h>

namespace toftwin::discover {
namespace {

/// A curve along one covariate, neither what light does there nor what is known by name.
bool goesAlongOne(const Context& context, const Effect& effect) {
  return !effect.is_catalogue && effect.covariates.size() == 1 &&
         infoOf(context, effect.covariates.front()) != nullptr;
}

TermGroup curveOf(const Effect& effect) { return {effect.name, Kind::Generic, termsOf(effect), 0}; }

/// Fitted together, both curves go against each other as far as what can hardly be told apart, and their mean squares are
/// four times their sum's (a convention).
bool nearlyCancel(const Context& without, const Effect& a, const Effect& b) {
  constexpr double kLarge = 4.0;
  const TermGroup both[]{curveOf(a), curveOf(b)};
  const Part prepared = prepare(without, both, false);
  const Marginal& marginal = prepared.marginal;
  const Group &of_a = marginal.groups[prepared.first], &of_b = marginal.groups[prepared.first + 1];
  Columns pair;
  append(pair, of_a), append(pair, of_b);
  Columns all = prepared.model;
  all.insert(all.end(), pair.begin(), pair.end());
  const Eigen::MatrixXd to_model = marginal.gram(pair, prepared.model);
  const Eigen::MatrixXd left =
      marginal.gram(pair, pair) - to_model * fit(marginal, prepared.model).inverse * to_model.transpose();
  Eigen::VectorXd curve_a = fit(marginal, all).coefficient.tail(left.rows()), curve_b = curve_a;
  curve_a.tail(static_cast<Eigen::Index>(of_b.count)).setZero();
  curve_b.head(static_cast<Eigen::Index>(of_a.count)).setZero();
  const double aa = curve_a.dot(left * curve_a), bb = curve_b.dot(left * curve_b), ab = curve_a.dot(left * curve_b);
  return ab < -kGoTogether * std::sqrt(aa * bb) && aa + bb > kLarge * (aa + bb + 2.0 * ab);
}

/// Both, as one explanation.
Explanation sumOf(const Context& without, const Effect& a, const Effect& b) {
  FittedForm both{.group = curveOf(a)};
  both.group.name = fmt::format("{} {} {}", a.name, isFormula(a) && isFormula(b) ? "+" : "plus", b.name);
  std::ranges::copy(termsOf(b), std::back_inserter(both.group.terms));
  Explanation sum = judged(without, {std::move(both)}).front();
  for (const Effect* effect : {&a, &b}) {
    for (const FittedForm& part : effect->parts) {
      sum.numbers += static_cast<int>(part.inner.size());
      for (const Inner& inner : part.form.inner) sum.price += inner.price;
    }
  }
  sum.gain.total -= sum.price;
  return sum;
}

/// Nothing where they stay two.
std::optional<Effect> asOne(const Found& found, const Effect& a, const Effect& b) {
  const bool are_curves = goesAlongOne(found.context, a) && goesAlongOne(found.context, b);
  if (!are_curves || a.covariates == b.covariates || a.stage != b.stage) return std::nullopt;
  std::vector<Effect> others;
  for (const Effect& other : found.effects)
    if (&other != &a && &other != &b) others.push_back(other);
  const Context without = knowingOnly(found, others);
  if (!nearlyCancel(without, a, b)) return std::nullopt;
  auto explanations = competeFor(without, a.covariates);
  std::ranges::move(competeFor(without, b.covariates), std::back_inserter(explanations));
  const auto single = choose(explanations);
  explanations.push_back(sumOf(without, a, b));
  const bool is_sum = !single || isMoreBy(0.0, explanations.back().gain, explanations[*single].gain);
  Effect one = effectOf(without, explanations, is_sum ? explanations.size() - 1 : *single);
  if (is_sum) {
    one.parts = a.parts;
    std::ranges::copy(b.parts, std::back_inserter(one.parts));
  }
  one.p = std::min(a.p, b.p);
  return one;
}

/// The first two of them that become one do; whether any did.
bool joinTwo(Found& found) {
  for (std::size_t i = 0; i < found.effects.size(); ++i) {
    for (std::size_t k = i + 1; k < found.effects.size(); ++k) {
      auto one = asOne(found, found.effects[i], found.effects[k]);
      if (!one) continue;
      settle(found, *one);
      found.effects[i] = *std::move(one);
      found.effects.erase(found.effects.begin() + static_cast<std::ptrdiff_t>(k));
      return true;
    }
  }
  return false;
}

}  // namespace

void joinCancelling(Found& found) {
  while (joinTwo(found)) continue;
}

}  // namespace toftwin::discover
