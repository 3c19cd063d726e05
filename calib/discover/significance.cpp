// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/significance.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "calib/discover/draws.h"
#include "calib/linear/linear.h"

namespace toftwin::discover {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A group after projection: T = |L u|², u = the moment of its columns minus slope · that of the model's.
struct Projected {
  std::size_t group = 0;
  Columns columns;
  MatrixXd slope;   ///< G_gM A⁻¹
  MatrixXd whiten;  ///< L: Lᵀ L = S⁺
  int rank = 0;
  double correction = 1.0;  ///< on flipped statistics: residuals are smaller than errors
};

Projected project(const Marginal& marginal, const Fit& model, const Group& group, std::size_t which) {
  Projected out;
  out.group = which;
  append(out.columns, group);
  const MatrixXd cross = marginal.gram(out.columns, model.columns);
  out.slope = cross * model.inverse;
  const MatrixXd left = marginal.gram(out.columns, out.columns) - out.slope * cross.transpose();
  // Sizes before projection: what is left of a column that the model explains is rounding.
  const VectorXd size = marginal.gram.diagonal()(out.columns).cwiseMax(0.0).cwiseSqrt();
  const VectorXd shrink = size.unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 0.0; });
  const auto [values, vectors] = linear::eigenpairs(shrink.asDiagonal() * left * shrink.asDiagonal());
  std::vector<Index> used;
  for (Index i = 0; i < values.size(); ++i) {
    if (values(i) > 1e-6) used.push_back(i);
  }
  out.rank = static_cast<int>(used.size());
  const VectorXd roots = values(used).cwiseSqrt().cwiseInverse();
  out.whiten =
      roots.asDiagonal() * MatrixXd(vectors(Eigen::all, used)).transpose() * shrink.asDiagonal();
  return out;
}

/// Residual moments of each capture in the group's whitened directions, one column for each capture.
MatrixXd whitenedMoments(const Projected& group, const MatrixXd& residual, const Columns& model) {
  const MatrixXd of_model = residual(model, Eigen::all);
  MatrixXd left = residual(group.columns, Eigen::all);
  left -= group.slope * of_model;
  return group.whiten * left;
}

/// Σ_c cov of the whitened moments under unit noise: E r_c r_cᵀ = G_c − G_c A⁻¹ G_c. Its trace is what
/// flipping gives on average; what data give is the rank.
double flipCorrection(const Marginal& marginal, const Fit& model, const Projected& group) {
  double trace = 0.0;
  for (const CaptureEvidence& capture : marginal.captures) {
    const MatrixXd to_group = capture.gram(group.columns, model.columns);
    const MatrixXd within = capture.gram(model.columns, model.columns);
    const MatrixXd turned = to_group - group.slope * within, half = group.whiten * turned;
    MatrixXd own = capture.gram(group.columns, group.columns);
    own -= turned * group.slope.transpose();
    own -= group.slope * to_group.transpose();
    trace += group.whiten.cwiseProduct(group.whiten * own).sum() -
             half.cwiseProduct(half * model.inverse).sum();  // of L S Lᵀ, and of H A⁻¹ Hᵀ
  }
  return trace > 1e-9 ? std::max(1.0, group.rank / trace) : 1.0;
}

/// A sum of squares with mean and variance of its null draws as a normal deviate: (E. B. Wilson, M. M.
/// Hilferty, PNAS 17 (1931) 684) with ν = 2 mean²/variance degrees of freedom.
struct Gauge {
  double mean = 1.0, nu = 1.0;
  explicit Gauge(const VectorXd& draws) {
    mean = std::max(draws.mean(), 1e-300);
    const double variance = (draws.array() - mean).square().mean();
    nu = variance > 0.0 ? std::clamp(2.0 * mean * mean / variance, 0.3, 1e6) : 1e6;
  }
  [[nodiscard]] double z(double statistic) const {
    const double v = 2.0 / (9.0 * nu);
    return (std::cbrt(std::max(statistic, 0.0) / mean) - (1.0 - v)) / std::sqrt(v);
  }
};

bool isTested(const Group& group, const std::set<Index>& model) {
  return (group.kind == Kind::Catalogue || group.kind == Kind::Generic) && group.count > 0 &&
         !model.contains(static_cast<Index>(group.first));
}

/// Dispersion of each capture about the model, at least 1/4 of the typical one: a capture of few rows may
/// look quieter than it is.
VectorXd dispersions(const Marginal& marginal, const Fit& model) {
  VectorXd out(static_cast<Index>(marginal.captures.size()));
  for (Index c = 0; c < out.size(); ++c) {
    const CaptureEvidence& capture = marginal.captures[static_cast<std::size_t>(c)];
    const double left = energyLeft(capture, model.columns, model.coefficient);
    out(c) = capture.rows > 0.0 ? std::max(0.0, left) / capture.rows : 1.0;
  }
  return out.cwiseMax(0.25 * model.dispersion());
}

/// Null draws of all statistics, one column a draw.
MatrixXd flippedDraws(const std::vector<Projected>& groups, const MatrixXd& residual, const Columns& model,
                      const TestOptions& options) {
  const Index captures = residual.cols();
  MatrixXd signs(captures, options.draws);
  Draws random(options.seed);
  for (int d = 0; d < options.draws; ++d) signs.col(d) = random.signs(captures);
  MatrixXd draws(static_cast<Index>(groups.size()), options.draws);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const MatrixXd sums = whitenedMoments(groups[g], residual, model) * signs;
    draws.row(static_cast<Index>(g)) = groups[g].correction * sums.colwise().squaredNorm();
  }
  return draws;
}

/// Of noise that has these moments, a column for each draw.
MatrixXd drawsOf(const std::vector<Projected>& groups, const MatrixXd& moments, const Columns& model) {
  MatrixXd draws(static_cast<Index>(groups.size()), moments.cols());
  for (std::size_t g = 0; g < groups.size(); ++g)
    draws.row(static_cast<Index>(g)) = whitenedMoments(groups[g], moments, model).colwise().squaredNorm();
  return draws;
}

MatrixXd noiseMoments(const Marginal& marginal, const VectorXd& dispersion, const TestOptions& options) {
  MatrixXd covariance = MatrixXd::Zero(marginal.gram.rows(), marginal.gram.cols());
  for (std::size_t c = 0; c < marginal.captures.size(); ++c)
    covariance += dispersion(static_cast<Index>(c)) * marginal.captures[c].gram;
  const auto [values, vectors] = linear::eigenpairs(covariance);
  const MatrixXd root = vectors * values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
  return root * Draws{options.seed}.normals(root.cols(), options.draws);
}

/// Xᵀ(y − X b).
VectorXd leftOf(const VectorXd& moment, const MatrixXd& gram, const Fit& model) {
  const MatrixXd of_model = gram(Eigen::all, model.columns);
  return moment - of_model * model.coefficient;
}

MatrixXd residualMoments(const Marginal& marginal, const Fit& model) {
  MatrixXd residual(marginal.moment.size(), static_cast<Index>(marginal.captures.size()));
  for (std::size_t c = 0; c < marginal.captures.size(); ++c) {
    const CaptureEvidence& capture = marginal.captures[c];
    residual.col(static_cast<Index>(c)) = leftOf(capture.moment, capture.gram, model);
  }
  return residual;
}

std::vector<Projected> projectedGroups(const Marginal& marginal, const Fit& model) {
  const std::set<Index> known(model.columns.begin(), model.columns.end());
  std::vector<Projected> groups;
  for (std::size_t g = 0; g < marginal.groups.size(); ++g) {
    if (!isTested(marginal.groups[g], known)) continue;
    Projected group = project(marginal, model, marginal.groups[g], g);
    if (group.rank > 0) groups.push_back(std::move(group));
  }
  return groups;
}

NullModel nullModelOf(const Marginal& marginal, NullModel wanted) {
  if (wanted != NullModel::Automatic) return wanted;
  return marginal.rows < 64.0 * static_cast<double>(marginal.captures.size()) ? NullModel::SignFlips
                                                                              : NullModel::Noise;
}

}  // namespace

std::vector<GroupScore> statistics(const Marginal& marginal, const Columns& model_columns) {
  const Fit model = fit(marginal, model_columns);
  const VectorXd residual = leftOf(marginal.moment, marginal.gram, model);
  std::vector<GroupScore> scores;
  for (const Projected& group : projectedGroups(marginal, model)) {
    const double statistic = whitenedMoments(group, residual, model_columns).squaredNorm();
    scores.push_back({group.group, statistic, group.rank, 0.0});
  }
  return scores;
}

double Test::Largest::take(double statistic, const VectorXd& draws) {
  const Gauge gauge(draws);
  if (of_draws.size() == 0) of_draws = VectorXd::Constant(draws.size(), -1e300);
  for (Index d = 0; d < draws.size(); ++d) of_draws(d) = std::max(of_draws(d), gauge.z(draws(d)));
  const double z = gauge.z(statistic);
  of_data = std::max(of_data, z);
  return z;
}

double Test::Largest::p() const {
  const auto above = static_cast<double>((of_draws.array() >= of_data).count());
  return (1.0 + above) / (static_cast<double>(of_draws.size()) + 1.0);
}

void Test::add(const Marginal& marginal, const Columns& model_columns, const MatrixXd& of_source) {
  out_.draws = options_.draws;
  out_.null_model = nullModelOf(marginal, options_.null_model);
  out_.has_of_source = of_source.size() > 0;
  if (marginal.captures.empty()) return;
  const Fit model = fit(marginal, model_columns);
  const MatrixXd residual = residualMoments(marginal, model);
  const VectorXd dispersion = dispersions(marginal, model);
  std::vector<Projected> groups = projectedGroups(marginal, model);
  if (groups.empty()) return;
  const bool is_flipped = out_.null_model == NullModel::SignFlips;
  if (is_flipped) {
    for (Projected& group : groups) group.correction = flipCorrection(marginal, model, group);
  }
  const VectorXd of_noise = dispersion.cwiseMax(options_.least_dispersion);
  const MatrixXd draws = is_flipped ? flippedDraws(groups, residual, model_columns, options_)
                                    : drawsOf(groups, noiseMoments(marginal, of_noise, options_), model_columns);
  const MatrixXd source_draws = out_.has_of_source ? drawsOf(groups, of_source, model_columns) : MatrixXd{};
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const auto row = static_cast<Index>(g);
    const double statistic =
        whitenedMoments(groups[g], residual, model_columns).rowwise().sum().squaredNorm();
    double z = by_captures_.take(statistic, draws.row(row).transpose());
    if (out_.has_of_source) z = std::min(z, by_source_.take(statistic, source_draws.row(row).transpose()));
    out_.scores.push_back({names_.size(), statistic, groups[g].rank, z});
    names_.push_back(marginal.groups[groups[g].group].name);
    if (out_.scores.back().z > out_.scores[out_.best].z) out_.best = out_.scores.size() - 1;
  }
}

Significance Test::result() const {
  Significance out = out_;
  if (out.scores.empty()) return out;
  out.p = by_captures_.p();
  if (out.has_of_source) out.p = std::max(out.p, by_source_.p());
  return out;
}

Significance test(const Marginal& marginal, const Columns& model, const TestOptions& options) {
  Test all{options};
  all.add(marginal, model);
  return all.result();
}

}  // namespace toftwin::discover
