// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/between_groups.h"

#include <algorithm>
#include <cmath>

#include <boost/math/distributions/fisher_f.hpp>

#include "calib/linear/linear.h"
#include "calib/loop/projection.h"

namespace toftwin::loop {
namespace {

/// With fewer, two numbers leave hardly any freedom to judge by.
constexpr int kFewestGroups = 5;

/// How many groups have rows: others were locked.
int groupsWithRows(const Evidence& evidence) {
  std::vector<bool> is_there(evidence.group_names.size(), false);
  for (const int group : evidence.group) is_there[static_cast<std::size_t>(group)] = true;
  return static_cast<int>(std::ranges::count(is_there, true));
}

/// Mean of each group's rows; 0 of a group without any. Rows of a group are many and err alike, so that groups count the same.
Eigen::VectorXd meansOf(const Evidence& evidence, const Eigen::VectorXd& values) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(evidence.groups()), count = sum;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const int group = evidence.group[static_cast<std::size_t>(i)];
    sum[group] += values[i], count[group] += 1.0;
  }
  return sum.cwiseQuotient(count.cwiseMax(1.0));
}

/// A row for each group, with the covariates that are one number in each.
Evidence rowsOfGroups(const Evidence& evidence, const Eigen::VectorXd& residual) {
  std::vector<Eigen::Index> with_rows;
  for (Eigen::Index g = 0; g < evidence.groups(); ++g)
    if (std::ranges::find(evidence.group, static_cast<int>(g)) != evidence.group.end()) with_rows.push_back(g);
  Evidence rows;
  rows.y = meansOf(evidence, residual)(with_rows);
  rows.sigma = Eigen::VectorXd::Ones(rows.y.size());
  if (evidence.reference.size() > 0) rows.reference = meansOf(evidence, evidence.reference)(with_rows);
  rows.group.assign(static_cast<std::size_t>(rows.y.size()), 0);
  rows.group_names = {""};
  for (const Covariate& c : evidence.covariates) {
    if (c.varies_within_groups || c.is_group_name) continue;
    Covariate one = c;
    one.varies_within_groups = true;
    one.x = meansOf(evidence, c.x)(with_rows);
    describe(one);
    rows.covariates.push_back(std::move(one));
  }
  return rows;
}

struct Candidate {
  Shape shape{};
  double left_out = 0.0;  ///< sum of squares of groups that were left out of the fit
  double p = 1.0;
};

/// One shape over the groups' means.
std::optional<Candidate> tryShape(const Evidence& rows, Shape shape) {
  const Eigen::Index n = rows.rows(), k = static_cast<Eigen::Index>(shape.columns.size());
  const Eigen::MatrixXd x = columnsOf(rows, shape.columns);
  if (!x.allFinite() || n < k + 3) return std::nullopt;
  Eigen::MatrixXd design(n, k + 1);
  design << Eigen::VectorXd::Ones(n), x;
  for (Eigen::Index c = 0; c <= k; ++c) design.col(c) /= std::max(1e-300, design.col(c).norm());
  const Eigen::MatrixXd hat = design * linear::Ldlt{design.transpose() * design}.solveEach(design.transpose());
  const Eigen::VectorXd left = rows.y - hat * rows.y;
  Candidate one{.shape = std::move(shape)};
  for (Eigen::Index i = 0; i < n; ++i) one.left_out += std::pow(left[i] / std::max(1e-6, 1.0 - hat(i, i)), 2);
  const double before = (rows.y.array() - rows.y.mean()).square().sum(), after = left.squaredNorm();
  const double freedom = static_cast<double>(n - k - 1);
  const double f = ((before - after) / static_cast<double>(k)) / std::max(1e-300, after / freedom);
  one.p = boost::math::cdf(boost::math::complement(boost::math::fisher_f{static_cast<double>(k), freedom}, std::max(0.0, f)));
  return one;
}

}  // namespace

namespace {

/// One simple shape over few groups.
std::optional<Effect> simpleShape(const Evidence& rows, double alpha) {
  std::vector<Candidate> all;
  for (const Family& family : families()) {
    for (const Covariate& c : rows.covariates) {
      const Covariate* argument = &c;
      const Arguments arguments{&argument, 1};
      const bool is_simple = family.moves.empty() || family.moves == "f";
      if (family.arguments != 1 || !is_simple || c.nature == table::Nature::Category || !family.applies(arguments)) continue;
      for (const Inner& inner : family.grid(arguments)) {
        Shape shape = shapeOf(family, arguments, inner);
        if (shape.columns.size() > 2) continue;
        if (auto one = tryShape(rows, std::move(shape))) all.push_back(*std::move(one));
      }
    }
  }
  if (all.empty()) return std::nullopt;
  const auto tried = static_cast<double>(all.size());
  const double n = static_cast<double>(rows.rows());
  const double without = (rows.y.array() - rows.y.mean()).square().sum() * std::pow(n / (n - 1.0), 2);
  auto best = std::ranges::min_element(all, {}, &Candidate::left_out);
  if (best->p * tried > alpha || best->left_out > 0.5 * without) return std::nullopt;
  // A straight line is simpler than another shape that predicts hardly better.
  for (auto one = all.begin(); one != all.end(); ++one)
    if (one->shape.numbers() == 1 && one->shape.has("straight line") && one->left_out < 1.3 * best->left_out && one->shape.covariates == best->shape.covariates) best = one;
  Effect effect{.shape = best->shape, .p = std::min(1.0, best->p * tried)};
  effect.gain.mean = 0.5 * n * std::log(without / std::max(1e-300, best->left_out));
  return effect;
}

}  // namespace

std::vector<Effect> explainGroups(const Evidence& evidence, const Eigen::VectorXd& residual, const ExplainOptions& options) {
  const int count = groupsWithRows(evidence);
  if (count < kFewestGroups) return {};
  Evidence rows = rowsOfGroups(evidence, residual);
  if (rows.covariates.empty()) return {};
  std::vector<Effect> found;
  if (count >= kGroupsSearched) {
    ExplainOptions search = options;
    search.seed += 500;
    found = explain(rows, search).effects;
  } else if (auto one = simpleShape(rows, options.alpha)) {
    found.push_back(*std::move(one));
  }
  for (Effect& effect : found) effect.rests_on = count;
  return found;
}

double varianceOfGroups(const Evidence& evidence, const Eigen::VectorXd& residual, double freedom) {
  // A group's mean scatters by s² = Σ m²/freedom; of n rows in it each would by n s².
  const Eigen::VectorXd mean = meansOf(evidence, residual);
  const double rows_a_group = static_cast<double>(evidence.rows()) / std::max(1, groupsWithRows(evidence));
  double squares = 0.0;
  for (const double m : mean) squares += m * m;
  return rows_a_group * squares / freedom;
}

Eigen::VectorXd groupOffsets(const Evidence& evidence, const Eigen::VectorXd& residual) {
  const Eigen::VectorXd mean = meansOf(evidence, residual);
  Eigen::VectorXd count = Eigen::VectorXd::Zero(evidence.groups());
  double within = 0.0;
  for (Eigen::Index i = 0; i < residual.size(); ++i) {
    const int group = evidence.group[static_cast<std::size_t>(i)];
    count[group] += 1.0;
    within += std::pow(residual[i] - mean[group], 2);
  }
  within /= std::max(1.0, static_cast<double>(residual.size() - mean.size()));
  // Moments: the means scatter by the offsets' variance and by their own noise.
  double rows = 0.0, grand = 0.0;
  for (Eigen::Index g = 0; g < mean.size(); ++g) rows += count[g] > 0 ? 1.0 : 0.0, grand += count[g] > 0 ? mean[g] : 0.0;
  grand /= std::max(1.0, rows);
  double scatter = 0.0, noise = 0.0;
  for (Eigen::Index g = 0; g < mean.size(); ++g) {
    if (count[g] == 0.0) continue;
    scatter += std::pow(mean[g] - grand, 2), noise += within / count[g];
  }
  const double variance = std::max(0.0, scatter / std::max(1.0, rows - 1.0) - noise / std::max(1.0, rows));
  Eigen::VectorXd offset = Eigen::VectorXd::Zero(mean.size());
  for (Eigen::Index g = 0; g < mean.size(); ++g)
    if (count[g] > 0.0 && variance > 0.0) offset[g] = (mean[g] - grand) * variance / (variance + within / count[g]);
  return offset;
}

}  // namespace toftwin::loop
