// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/overlap.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace toftwin::loop {
namespace {

/// With fewer rows a deviation is known to no better than a sixth.
constexpr std::size_t kFewest = 20;
/// Alike: nearer than so much of a column's span. Over that distance what is left of a smooth error hardly changes.
constexpr double kAlikeSpan = 1.0 / 500.0;

/// Columns that say what was measured. What goes with the lines tells series apart by itself.
std::vector<const Covariate*> compared(const Evidence& evidence) {
  std::vector<const Covariate*> all;
  for (const Covariate& c : evidence.covariates)
    if (!c.is_reference && !c.is_order && !c.is_group_name && !c.goes_with_lines) all.push_back(&c);
  return all;
}

bool areAlike(const std::vector<const Covariate*>& columns, Eigen::Index a, Eigen::Index b) {
  return std::ranges::all_of(columns, [&](const Covariate* c) { return std::abs(c->x[a] - c->x[b]) <= kAlikeSpan * c->span(); });
}

}  // namespace

double Overlap::least() const { return deviation / std::numbers::sqrt2; }

std::optional<Overlap> overlapOf(const Evidence& evidence, const Eigen::VectorXd& left, const std::vector<int>& series) {
  if (evidence.reference.size() == 0 || evidence.rows() == 0) return std::nullopt;
  const auto columns = compared(evidence);
  std::vector<Eigen::Index> order(static_cast<std::size_t>(evidence.rows()));
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<Eigen::Index>(i);
  std::ranges::stable_sort(order, {}, [&](Eigen::Index i) { return evidence.reference[i]; });
  const double span = evidence.reference.maxCoeff() - evidence.reference.minCoeff();
  Overlap overlap{.apart = kAlikeSpan * span};
  std::vector<double> differences;
  std::size_t first = 0;
  for (const Eigen::Index row : order) {
    while (evidence.reference[row] - evidence.reference[order[first]] > overlap.apart) ++first;
    double sum = 0.0, count = 0.0;
    for (std::size_t k = first; k < order.size() && evidence.reference[order[k]] - evidence.reference[row] <= overlap.apart; ++k) {
      const bool is_earlier = series[static_cast<std::size_t>(order[k])] < series[static_cast<std::size_t>(row)];
      if (is_earlier && areAlike(columns, row, order[k])) sum += left[order[k]], count += 1.0;
    }
    if (count > 0.0) differences.push_back(left[row] - sum / count);
  }
  overlap.rows = differences.size();
  if (overlap.rows < kFewest) return std::nullopt;
  double squares = 0.0;
  for (const double d : differences) overlap.mean += d / static_cast<double>(overlap.rows);
  for (const double d : differences) squares += (d - overlap.mean) * (d - overlap.mean);
  overlap.deviation = std::sqrt(squares / static_cast<double>(overlap.rows - 1));
  return overlap;
}

}  // namespace toftwin::loop
