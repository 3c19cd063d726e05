// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "calib/discover/marginal.h"

/// Does a group predict captures that it was not fitted to?
namespace toftwin::discover {

/// How much less deviance is left of held-out captures with the group than without it; in units of the
/// noise's variance, so that an effect of noncentrality λ with k numbers gains about λ − k.
struct Gain {
  std::size_t group = 0;
  double total = 0.0;
  std::vector<double> by_capture{};
};

/// Which fold each capture is in: they take turns within their block, so that every fold has some of each.
std::vector<int> foldsOf(const Marginal& marginal, int folds = 5);

/// What is left of each capture by a model that was fitted to the other folds.
std::vector<double> heldOut(const Marginal& marginal, const Columns& columns, int folds = 5);
/// How much less is left after than before.
Gain gainOf(const std::vector<double>& before, std::vector<double> after);

/// For each of `groups` on top of `model`.
std::vector<Gain> crossValidate(const Marginal& marginal, const Columns& model,
                                const std::vector<std::size_t>& groups, int folds = 5);

/// a − b over the captures, and its standard error.
struct Difference {
  double mean = 0.0, error = 0.0;
};
Difference difference(const Gain& a, const Gain& b);
/// The total with its standard error.
Difference against0(const Gain& gain);
/// Whether a gain on captures that were not fitted to is no chance: two standard errors over captures. Or, since what
/// only a few captures can show (those of a cold camera) varies between captures as much as it is, three captures'
/// worth of it — the sum over its root of squares is √n where n captures carry it — and two standard errors of the
/// noise, 2√gain each. One or two captures alone may have been bumped. A capture that says more than ten standard
/// errors counts as one that says ten: that the coldest of five says three times as much as the next is no reason to
/// doubt them.
bool holds(const Gain& gain);
/// Whether what one says more than the other holds, and is so much.
bool isMoreBy(double enough, const Gain& more, const Gain& less);

}  // namespace toftwin::discover
