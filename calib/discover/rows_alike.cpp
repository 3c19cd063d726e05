// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/rows_alike.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace toftwin::discover {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr int kFewestRuns = 8;

}  // namespace

std::vector<Runs> runsOfEqualValues(const TableData& data) {
  std::vector<Runs> found;
  for (const TableCovariate& covariate : data.covariates) {
    Runs runs{covariate.name, {}, 0};
    for (std::size_t i = 0; i < data.rows(); ++i) {
      const bool goes_on =
          i > 0 && covariate.values[i] == covariate.values[i - 1] && data.session[i] == data.session[i - 1];
      runs.count += !goes_on;
      runs.run.push_back(runs.count - 1);
    }
    const std::set<double> values(covariate.values.begin(), covariate.values.end());
    if (runs.count < kFewestRuns || 3 * static_cast<std::size_t>(runs.count) > data.rows()) continue;
    if (2 * values.size() >= static_cast<std::size_t>(runs.count)) found.push_back(std::move(runs));
  }
  std::ranges::stable_sort(found, {}, &Runs::count);
  return found;
}

double alikeness(const Runs& runs, const VectorXd& residual) {
  std::vector<double> sum(static_cast<std::size_t>(runs.count)), rows(sum.size());
  for (Index i = 0; i < residual.size(); ++i) {
    const auto run = static_cast<std::size_t>(runs.run[static_cast<std::size_t>(i)]);
    sum[run] += residual(i), rows[run] += 1.0;
  }
  double between = 0.0;
  for (std::size_t r = 0; r < sum.size(); ++r)
    if (rows[r] > 0.0) between += sum[r] * sum[r] / rows[r];
  const auto count = static_cast<double>(runs.count), freedom = static_cast<double>(residual.size()) - count;
  const double within = residual.squaredNorm() - between;
  if (!(within > 0.0) || freedom <= 0.0) return 0.0;
  return (between / count / (within / freedom) - 1.0) / std::sqrt(2.0 / count + 2.0 / freedom);
}

}  // namespace toftwin::discover
