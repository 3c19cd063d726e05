// SPDX-License-Identifier: Apache-2.0
#pragma once

/// The share of what can be explained that a model removes, and what of it noise allows.
namespace toftwin::discover {

/// What a model removes of the χ² that another leaves over noise, and what it leaves.
struct Balance {
  double removed = 0.0, left = 0.0;
};

/// removed / (removed + left): what is left of something explainable is not negative, whatever noise says. NaN where
/// nothing is explainable.
double shareOf(const Balance& balance);

struct ShareInterval {
  double low = 0.0, high = 0.0;
};

/// 95 % of the shares that noise of these standard deviations allows. At the low end what is left is drawn as it is
/// known not to be negative: where noise made χ² less than its mean, that is no proof that nothing is. NaN where no
/// row says anything.
ShareInterval intervalOf(const Balance& balance, const Balance& sigma);

}  // namespace toftwin::discover
