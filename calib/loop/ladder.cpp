// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/ladder.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace toftwin::loop {
namespace {

Step stepOf(std::string name, const Eigen::VectorXd& left) {
  Step step{.name = std::move(name)};
  std::vector<double> sizes;
  for (const double r : left)
    if (std::isfinite(r)) sizes.push_back(std::abs(r));
  if (sizes.empty()) return step;
  double squares = 0.0;
  for (const double r : sizes) squares += r * r;
  step.rms = std::sqrt(squares / static_cast<double>(sizes.size()));
  const auto at = sizes.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(sizes.size() - 1));
  std::nth_element(sizes.begin(), at, sizes.end());
  step.p95 = *at;
  return step;
}

}  // namespace

Ladder ladderOf(const TableEvidence& table, const Model& model) {
  Ladder ladder{.rows = static_cast<std::size_t>(table.evidence.rows())};
  if (ladder.rows == 0) return ladder;
  // Without a reference scatter about the mean is all that can be told.
  ladder.has_truth = table.hasTruth();
  const auto left = [&](const std::vector<terms::Term>& terms) {
    Eigen::VectorXd after = table.evidence.y - predicted(table.evidence, terms);
    if (!ladder.has_truth) after.array() -= after.mean();
    return after;
  };
  const auto add = [&](const std::string& name, const std::vector<terms::Term>& terms) {
    const auto needed = terms::covariatesOf(terms);
    const bool is_known = std::ranges::all_of(needed, [&](const std::string& one) { return table.evidence.find(one) != nullptr; });
    if (is_known) ladder.steps.push_back(stepOf(name, left(terms)));
  };
  add("raw", {});
  // A constant and a gain are of a truth.
  for (const Rung& rung : model.rungs)
    if (ladder.has_truth) add(rung.name, rung.terms);
  add("effects", termsOf(model));
  return ladder;
}

Repeats repeatsOf(const Evidence& evidence) {
  std::map<std::vector<double>, std::vector<double>> same;
  for (Eigen::Index i = 0; i < evidence.rows(); ++i) {
    std::vector<double> key{static_cast<double>(evidence.group[static_cast<std::size_t>(i)])};
    for (const Covariate& c : evidence.covariates)
      if (!c.is_order) key.push_back(c.x[i]);
    same[key].push_back(evidence.y[i]);
  }
  double squares = 0.0, freedom = 0.0;
  Repeats repeats;
  for (const auto& [key, values] : same) {
    if (values.size() < 2) continue;
    double mean = 0.0;
    for (const double y : values) mean += y / static_cast<double>(values.size());
    for (const double y : values) squares += (y - mean) * (y - mean);
    freedom += static_cast<double>(values.size() - 1), repeats.rows += values.size();
  }
  /// With fewer, their deviation is known to no better than a fifth.
  constexpr double kFewest = 12.0;
  if (freedom >= kFewest) repeats.deviation = std::sqrt(squares / freedom);
  else repeats.rows = 0;
  return repeats;
}

TableEvidence rowsOf(const TableEvidence& table, const std::vector<Eigen::Index>& rows) {
  TableEvidence part{.evidence = rowsOf(table.evidence, rows), .notes = table.notes};
  for (const Eigen::Index row : rows) part.row.push_back(table.row[static_cast<std::size_t>(row)]);
  part.measured = table.measured.size() > 0 ? table.measured(rows).eval() : table.measured;
  return part;
}

}  // namespace toftwin::loop
