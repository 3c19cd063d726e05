// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Dense>

#include "calib/discover/candidates.h"
#include "calib/discover/marginal.h"
#include "calib/discover/rows_alike.h"
#include "calib/discover/table_source.h"

namespace toftwin::discover {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kHuber = 3.0;

/// What is known, and powers, smooth functions, products and waves of the covariates, as long as four rows
/// are left for each column.
MatrixXd flexible(const TableData& data, const std::vector<CovariateInfo>& infos, const MatrixXd& known) {
  MatrixXd x = known;
  const auto most = static_cast<Index>(data.rows() / 4);
  const auto add = [&](const std::vector<Term>& terms) {
    const auto count = static_cast<Index>(terms.size());
    if (count == 0 || x.cols() + count > most) return;
    x.conservativeResize(Eigen::NoChange, x.cols() + count);
    MatrixXd columns = columnsOf(data, terms);
    // Columns of very different size would make a normal matrix that rounding spoils.
    for (Index i = 0; i < count; ++i) columns.col(i) /= std::max(columns.col(i).norm(), 1e-300);
    x.rightCols(count) = columns;
  };
  const auto candidates = genericCandidates(infos, {.captures = data.rows()});
  const auto isWave = [](const TermGroup& group) { return group.terms[0].factors[0].shape == Shape::Sine; };
  for (const TermGroup& group : candidates)
    if (covariatesOf(group).size() == 1 && !isWave(group)) add(group.terms);
  std::vector<Term> straight;
  for (const CovariateInfo& info : infos) {
    if (info.nature == Nature::Category) continue;
    straight.push_back({{{info.name, Shape::Power, {1.0}}}, {}});
    if (info.quantiles.front() > 0.0) {
      add({{{{info.name, Shape::Power, {-1.0}}}, {}},
           {{{info.name, Shape::Power, {-2.0}}}, {}},
           {{{info.name, Shape::Log, {}}}, {}}});
    }
  }
  for (std::size_t i = 0; i < straight.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) add(products({straight[i]}, {straight[j]}));
  for (const TermGroup& group : candidates)
    if (covariatesOf(group).size() == 1 && isWave(group)) add(group.terms);
  for (const TermGroup& group : candidates)
    if (covariatesOf(group).size() == 2) add(group.terms);
  return x;
}

struct Residual {
  VectorXd value;
  double freedom = 1.0;
};

Residual residualOf(const MatrixXd& x, const VectorXd& y, const VectorXd& weight) {
  const VectorXd root = weight.cwiseSqrt();
  const MatrixXd wx = root.asDiagonal() * x;
  const PseudoInverse inverse = pseudoInverse(wx.transpose() * wx, 1e-8);
  const VectorXd coefficient = inverse.inverse * (wx.transpose() * root.cwiseProduct(y));
  return {y - x * coefficient, std::max(1.0, static_cast<double>(y.size()) - inverse.rank)};
}

double medianOf(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

/// Whether |residual| goes with a covariate: ln of its square on a smooth function, if that explains far more
/// than chance. ln χ²₁ has variance π²/2.
void findGrowth(const TableData& data, const std::vector<CovariateInfo>& infos, const VectorXd& residual,
                TableNoise& noise, VectorXd& relative) {
  VectorXd logs(residual.size());
  const double floor = 1e-4 * residual.squaredNorm() / static_cast<double>(residual.size());
  for (Index i = 0; i < logs.size(); ++i)
    logs(i) = std::log(residual(i) * residual(i) / (relative(i) * relative(i)) + std::max(floor, 1e-300));
  const double mean = logs.mean();
  double best = 25.0;  // χ² with up to 3 degrees of freedom: 1e-5, so that it stays silent without reason
  VectorXd chosen;
  for (const CovariateInfo& info : infos) {
    TermGroup group = smoothIn(info, 4);
    if (group.terms.empty() ||
        static_cast<double>(group.terms.size()) > 0.05 * static_cast<double>(data.rows()))
      continue;
    MatrixXd x(residual.size(), static_cast<Index>(group.terms.size()) + 1);
    x.col(0).setOnes();
    x.rightCols(static_cast<Index>(group.terms.size())) = columnsOf(data, group.terms);
    const Residual left = residualOf(x, logs, VectorXd::Ones(logs.size()));
    const double gain = ((logs.array() - mean).square().sum() - left.value.squaredNorm()) / 4.93;
    if (gain <= best) continue;
    best = gain, chosen = 0.5 * (logs - left.value);
    noise.grows_with = info.name;
  }
  if (chosen.size() == 0) return;
  for (Index i = 0; i < relative.size(); ++i)
    relative(i) *= std::exp(std::clamp(chosen(i) - 0.5 * mean, -2.5, 2.5));
}

/// A warm-up begins more steeply than hats at an eighth of the rows follow, and what they leave of it is no wander.
void addSteepStart(const CovariateInfo& info, std::vector<Term>& terms) {
  if (info.nature != Nature::Time || info.quantiles.empty()) return;
  const double first = info.quantiles.front(), span = info.quantiles.back() - first;
  if (!(span > 0.0)) return;
  for (const double part : {40.0, 12.0}) terms.push_back({{{info.name, Shape::Decay, {span / part, first}}}, {}});
}

/// What is known, and each covariate's slow course by up to `most_knots` hats: waves and products would take
/// what rows err by together, too.
MatrixXd slowColumns(const TableData& data, const std::vector<CovariateInfo>& infos, const MatrixXd& known,
                     std::size_t most_knots) {
  for (std::size_t knots = most_knots;; --knots) {
    std::vector<Term> terms;
    for (const CovariateInfo& info : infos) {
      for (Term& term : smoothIn(info, knots).terms) terms.push_back(std::move(term));
      addSteepStart(info, terms);
    }
    if (knots > 2 && 8 * terms.size() > data.rows()) continue;
    MatrixXd x(known.rows(), known.cols() + static_cast<Index>(terms.size()));
    x << known, columnsOf(data, terms);
    return x;
  }
}

/// What is left of that, clipped at three deviations.
VectorXd slowResidual(const TableData& data, const std::vector<CovariateInfo>& infos, const MatrixXd& known) {
  constexpr std::size_t kKnots = 5;
  const VectorXd y = Eigen::Map<const VectorXd>(data.error.data(), static_cast<Index>(data.rows()));
  VectorXd left = residualOf(slowColumns(data, infos, known, kKnots), y, VectorXd::Ones(y.size())).value;
  std::vector<double> magnitudes;
  for (const double v : left) magnitudes.push_back(std::abs(v));
  const double most = kHuber * 1.4826 * medianOf(magnitudes);
  return most > 0.0 ? VectorXd(left.cwiseMin(most).cwiseMax(-most)) : left;
}

/// A jump is no correlation, and hats cannot follow it: the one that takes most of what they leave, over all
/// covariates.
MatrixXd withStep(const TableData& data, const MatrixXd& x, const VectorXd& left) {
  const Index n = left.size();
  VectorXd best = VectorXd::Zero(n);
  double most = 0.0;
  const double mean = left.mean();
  for (const TableCovariate& covariate : data.covariates) {
    if (covariate.nature == Nature::Category) continue;
    std::vector<Index> order(static_cast<std::size_t>(n));
    std::iota(order.begin(), order.end(), Index{0});
    const auto value = [&](Index row) { return covariate.values[static_cast<std::size_t>(row)]; };
    std::ranges::stable_sort(order, {}, value);
    double sum = 0.0;
    for (Index k = 1; k < n; ++k) {
      const Index row = order[static_cast<std::size_t>(k - 1)], next = order[static_cast<std::size_t>(k)];
      sum += left(row) - mean;
      const double gain =
          sum * sum * static_cast<double>(n) / (static_cast<double>(k) * static_cast<double>(n - k));
      if (gain <= most || !(value(row) < value(next))) continue;
      most = gain;
      for (Index i = 0; i < n; ++i) best(i) = value(i) >= value(next) ? 1.0 : 0.0;
    }
  }
  MatrixXd all(n, x.cols() + 1);
  all << x, best;
  return all;
}

}  // namespace

std::optional<Runs> alikeRuns(const TableData& data, const std::vector<CovariateInfo>& infos,
                              const MatrixXd& known) {
  std::optional<Runs> found;
  double most = 2.5;
  const auto candidates = runsOfEqualValues(data);
  if (candidates.empty()) return found;
  const VectorXd residual = slowResidual(data, infos, known);
  for (const Runs& runs : candidates)
    if (const double here = alikeness(runs, residual); here > most) most = here, found = runs;
  return found;
}

TableNoise estimateNoise(const TableData& data, const std::vector<CovariateInfo>& infos,
                         const MatrixXd& known, const std::vector<RowClock>& clocks) {
  TableNoise noise;
  const auto n = static_cast<Index>(data.rows());
  const MatrixXd x = flexible(data, infos, known);
  const VectorXd y = Eigen::Map<const VectorXd>(data.error.data(), n);
  VectorXd relative =
      data.sigma.empty() ? VectorXd::Ones(n) : VectorXd(Eigen::Map<const VectorXd>(data.sigma.data(), n));
  relative /= medianOf({relative.begin(), relative.end()});
  VectorXd weight = VectorXd::Ones(n);
  double scale = 1.0;
  for (int round = 0; round < 4; ++round) {
    const Residual left = residualOf(x, y, weight.cwiseQuotient(relative.cwiseAbs2()));
    const VectorXd standard = left.value.cwiseQuotient(relative);
    // What is left of few rows is smaller than what they err by.
    const double shrink = std::sqrt(static_cast<double>(n) / left.freedom);
    std::vector<double> magnitudes;
    for (const double v : standard) magnitudes.push_back(std::abs(v) * shrink);
    const double middle = 1.4826 * medianOf(magnitudes);
    scale = std::sqrt(weight.cwiseProduct(standard.cwiseAbs2()).sum() /
                      std::max(1.0, weight.sum() * left.freedom / static_cast<double>(n)));
    // Rows that are rounded may be equal in most: then the median says nothing.
    const double ruler = middle > 0.05 * scale ? middle : scale;
    noise.outliers = 0;
    for (Index i = 0; i < n; ++i) {
      const double size = magnitudes[static_cast<std::size_t>(i)];
      weight(i) = size > kHuber * ruler ? kHuber * ruler / size : 1.0;
      noise.outliers += size > kHuber * ruler;
    }
    if (round == 1 && data.sigma.empty()) findGrowth(data, infos, left.value, noise, relative);
  }
  const VectorXd root = weight.cwiseSqrt().cwiseQuotient(relative);
  const MatrixXd slow = slowColumns(data, infos, known, kSmoothKnots);
  const VectorXd standardised = root.cwiseProduct(residualOf(slow, y, root.cwiseAbs2()).value);
  noise.dependence =
      dependenceOf(clocks, root.cwiseProduct(y), root.asDiagonal() * withStep(data, slow, standardised));
  if (noise.dependence) {
    scale = std::sqrt(noise.dependence->best.variance);
    if (!noise.dependence->isClear()) noise.scatter = std::sqrt(noise.dependence->white) / scale;
  }
  // A table without any noise (computed, or rounded to nothing) still needs a scale.
  const double smallest = 1e-9 * std::max(y.cwiseAbs().maxCoeff(), 1e-12);
  for (Index i = 0; i < n; ++i) {
    noise.sigma.push_back(std::max(scale * relative(i), smallest));
    noise.weight.push_back(weight(i));
  }
  noise.typical = noise.scatter * medianOf(noise.sigma);
  return noise;
}

}  // namespace toftwin::discover
