// SPDX-License-Identifier: Apache-2.0
// Ranges that are off by whole periods.
#include <cmath>
#include <numeric>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/least_squares.h"
#include "calib/compare/traits/traits.h"

namespace toftwin::compare {

Traits wrapTraits(Column error_m, double period_m) {
  if (!(period_m > 0.0)) return undetermined("wraps", "the period must be a positive length");
  const auto rows = finiteRows({error_m}, 1, "wraps");
  if (!rows) return rows.error();
  std::vector<double> wraps;
  for (const double e : rows->front()) wraps.push_back(std::round(e / period_m) != 0.0 ? 1.0 : 0.0);
  const double n = static_cast<double>(wraps.size()), wrapped = std::reduce(wraps.begin(), wraps.end());
  // Rows that wrap with their neighbours are so many trials as they go with each other.
  const double rho =
      correlationOfResiduals([](std::span<const double> at, std::size_t) { return at[0]; }, wraps,
                             {.at = {wrapped / n}});
  const double share = (1.0 - rho) / (1.0 + rho);
  const auto interval = shareInterval(share * wrapped, share * n, ShareRule::Jeffreys);
  return std::vector{Trait{"wrapped", "1", wrapped / n, interval.low, interval.high, wraps.size()}};
}

Traits wrapTraits(Column shares) {
  const auto rows = finiteRows({shares}, 2, "wraps");
  if (!rows) return rows.error();
  const Summary all = summarise(rows->front());
  const double n = static_cast<double>(all.n), p = all.mean;
  // Effective number of trials (E. L. Korn, B. I. Graubard, Surv. Methodol. 24 (1998) 193); where all parts are
  // alike, their scatter says nothing, and each of them is a trial.
  const double trials = all.sd > 0.0 ? p * (1.0 - p) * n / (all.sd * all.sd) : n;
  const auto interval = shareInterval(p * trials, trials, ShareRule::Jeffreys);
  return std::vector{Trait{"wrapped", "1", p, interval.low, interval.high, all.n}};
}

}  // namespace toftwin::compare
