// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/discover/finding.h"

/// Which covariates, and which function of them.
namespace toftwin::discover {

/// One explanation in the competition: a formula, a smooth curve or a catalogue effect.
struct Explanation {
  std::string name{};
  std::vector<std::string> covariates{};  ///< sorted
  std::optional<Stage> stage{};
  FittedForm fitted{};  ///< its group has no terms for a catalogue effect
  bool is_catalogue = false;
  bool is_sum = false;  ///< two smooth functions added up: what a pair has to beat
  int numbers = 0;
  double price = 0.0;  ///< for inner numbers that were searched
  Gain gain{};
  std::shared_ptr<const NamedFit> named{};  ///< an effect of the catalogue that was fitted as itself
  std::string refused{};  ///< why such an effect is not named; empty: it may be

  /// What its terms are multiplied with: a covariate's function then is one of one covariate, not of two.
  [[nodiscard]] std::string carrier() const {
    return fitted.group.terms.empty() ? "" : fitted.group.terms.front().carrier;
  }
};

/// Everything that a choice needs to know.
struct Context {
  std::shared_ptr<const RowSource> source;
  std::vector<CovariateInfo> covariates;
  std::vector<TermGroup> generic;
  std::vector<TermGroup> known;  ///< effects found before, with their tangents
  std::vector<double> scales;
  std::vector<std::string> catalogue{};  ///< effects of the catalogue that were found before
  std::vector<std::string> withdrawn{};  ///< names that were given and taken back
  /// The source without any found effect, and the effects that `source` includes.
  std::shared_ptr<const RowSource> original{};
  std::vector<std::shared_ptr<const NamedFit>> included{};
  TestOptions test{};
  double alpha = 0.01;
};
/// Whether what acts together explains more than its parts do: by 2.5 standard errors over captures, and by 5 %.
bool isMoreThanParts(const Gain& together, const Gain& parts);

/// Nothing where it is no covariate, but what a source calls a carrier.
const CovariateInfo* infoOf(const Context& context, const std::string& name);

/// What curves of this set of covariates, sorted, are multiplied with, where it is the same for all terms of one: a
/// carrier, or several of one name.
std::vector<const Term*> carriersAlong(const Context& context, const std::vector<std::string>& covariates);

/// Columns of the nuisances and of what is known, in evidence that was made with `extra` more groups, the
/// known ones first.
Columns modelOf(const Context& context, const Marginal& marginal, std::size_t extra);

/// Evidence for some groups on top of what is known, some columns at a time: each part with its model and the
/// number of its first new group. The catalogue is in the first part only.
std::vector<TermGroup> withKnown(const Context& context, std::span<const TermGroup> groups);
struct Part {
  Marginal marginal;
  Columns model;
  std::size_t first = 0;
  std::size_t begin = 0, end = 0;  ///< of the groups
};
Part prepare(const Context& context, std::span<const TermGroup> groups, bool with_catalogue);
void inParts(const Context& context, const std::vector<TermGroup>& groups,
             const std::function<void(const Part&)>& use);

/// The competition over all covariates: the generic groups by cross-validation first, then formulas for the
/// sets of covariates that are not much worse than the best.
std::vector<Explanation> compete(const Context& context);
/// Only over these covariates.
std::vector<Explanation> competeFor(const Context& context, const std::vector<std::string>& covariates);

/// Explanations of these forms with their gains, on the same folds.
std::vector<Explanation> judged(const Context& context, std::vector<FittedForm> forms);

/// Places of explanations that may be chosen: a pair of covariates only if it acts together.
std::vector<std::size_t> eligible(const std::vector<Explanation>& explanations);

/// The simplest that is not worse than the best by more than a standard error of their difference. A pair of
/// covariates must also beat the sum of their own functions; a catalogue effect wins when it is about as
/// good. Gives its place; nothing when there are none.
std::optional<std::size_t> choose(const std::vector<Explanation>& explanations);

/// The best of M explanations is better than it is by about 2 ln M in χ², by chance alone (D. P. Foster,
/// E. I. George, Ann. Stat. 22 (1994) 1947). At least that of one number at two standard errors.
double luckOfTheBestOf(std::size_t tried);

/// Where the source can fit its catalogue: those effects that could be worth it are fitted, the others go.
void fitCatalogue(const Context& context, std::vector<Explanation>& explanations);
/// An effect of the catalogue that was fitted, if one is to be named: it predicts other captures, no free
/// curve does so better (2 standard errors), what it leaves does not go with its own covariates, and no formula
/// with fewer numbers is as good.
std::optional<std::size_t> chooseNamed(const Context& context, std::vector<Explanation>& explanations);

/// Correlation of two fitted curves over the captures, the context's model projected out of both: its square is the
/// share of one that the other explains, too.
double correlationOf(const Context& context, const TermGroup& a, const TermGroup& b);

/// Its place among `explanations` and what else explains as much, the next experiment, how often it is best.
Effect effectOf(const Context& context, const std::vector<Explanation>& explanations, std::size_t chosen);

}  // namespace toftwin::discover
