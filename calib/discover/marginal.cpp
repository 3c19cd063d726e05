// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/marginal.h"
#include "calib/discover/term.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/linear/linear.h"

namespace toftwin::discover {
namespace {

/// Factors that are tried; 0: there is no such effect.
constexpr std::array kScales{0.0,  0.004, 0.008, 0.016, 0.03, 0.06, 0.125, 0.18, 0.25, 0.35, 0.5, 0.7,
                             0.85, 1.0,   1.2,   1.4,   1.7,  2.0,  2.5,   3.0,  4.0,  6.0,  8.0, 16.0};

double scaleOf(const Group& group, std::span<const double> scale) {
  const auto which = static_cast<std::size_t>(group.scale_class);
  return which < scale.size() ? scale[which] : 1.0;
}

/// What stays, and what is integrated out with its deviations.
struct Split {
  Columns kept, random;
  Eigen::VectorXd deviation;
};

Split splitOf(const Evidence& evidence, std::span<const double> scale) {
  Split split;
  std::vector<double> deviation;
  for (const Group& group : evidence.groups) {
    if (group.kind == Kind::PerCapture) {
      append(split.random, group);
      deviation.insert(deviation.end(), group.count, scaleOf(group, scale));
    } else {
      append(split.kept, group);
    }
  }
  split.deviation =
      Eigen::Map<Eigen::VectorXd>(deviation.data(), static_cast<Eigen::Index>(deviation.size()));
  return split;
}

/// With B = S ZᵀZ S + I: (I + Z S² Zᵀ)⁻¹ = I − Z S B⁻¹ S Zᵀ.
CaptureEvidence integratedOut(const CaptureEvidence& capture, const Split& split, double& log_determinant) {
  CaptureEvidence out;
  out.rows = capture.rows, out.name = capture.name, out.block = capture.block;
  out.gram = capture.gram(split.kept, split.kept);
  out.moment = capture.moment(split.kept);
  out.energy = capture.energy;
  if (split.random.empty()) return out;
  const auto s = split.deviation.asDiagonal();
  Eigen::MatrixXd inner = s * Eigen::MatrixXd(capture.gram(split.random, split.random)) * s;
  inner.diagonal().array() += 1.0;
  const Eigen::MatrixXd to_kept = capture.gram(split.random, split.kept), lower = linear::choleskyOf(inner),
                        half = linear::solveLowerEach(lower, s * to_kept);
  const Eigen::VectorXd half_y = linear::solveLower(lower, s * Eigen::VectorXd(capture.moment(split.random)));
  out.gram -= half.transpose() * half;
  out.moment -= half.transpose() * half_y;
  out.energy -= half_y.squaredNorm();
  log_determinant += 2.0 * lower.diagonal().array().log().sum();
  return out;
}

/// −2 ln of the restricted likelihood, with the noise's own scale profiled.
double criterion(const Evidence& evidence, std::span<const std::string> projected,
                 std::span<const double> scale) {
  const Marginal marginal = marginalise(evidence, scale);
  Columns columns = nuisanceColumns(marginal);
  for (const Group& group : marginal.groups) {
    if (std::ranges::find(projected, group.name) != projected.end()) append(columns, group);
  }
  const Fit fitted = fit(marginal, columns);
  // Shared columns are random: the rank that they take is not lost, their prior stands in the determinant.
  double freedom = fitted.freedom;
  for (const Group& group : marginal.groups) {
    if (group.kind == Kind::Shared) freedom += static_cast<double>(group.count);
  }
  freedom = std::min(freedom, marginal.rows - 1.0);
  if (freedom <= 0.0) return 0.0;
  double log_fixed = 0.0;
  Eigen::MatrixXd gram = marginal.gram(columns, columns);
  gram.diagonal() += marginal.precision(columns);
  const Eigen::VectorXd size = gram.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const Eigen::MatrixXd scaled = size.cwiseInverse().asDiagonal() * gram * size.cwiseInverse().asDiagonal();
  for (const double value : linear::eigenvalues(scaled)) log_fixed += value > 1e-9 ? std::log(value) : 0.0;
  for (const double value : size) log_fixed += 2.0 * std::log(value);
  return marginal.log_determinant + log_fixed +
         freedom * std::log(std::max(fitted.deviance, 1e-300) / freedom);
}

}  // namespace

void append(Columns& columns, const Group& group) {
  for (std::size_t i = 0; i < group.count; ++i) columns.push_back(static_cast<Eigen::Index>(group.first + i));
}

Marginal marginalise(const Evidence& evidence, std::span<const double> scale) {
  Marginal marginal;
  const Split split = splitOf(evidence, scale);
  std::size_t next = 0;
  std::vector<double> precision;
  for (Group group : evidence.groups) {
    if (group.kind == Kind::PerCapture) continue;
    group.first = next, next += group.count;
    const double deviation = scaleOf(group, scale);
    double weight = 0.0;
    if (group.kind == Kind::Shared) {
      weight = 1.0 / std::max(deviation * deviation, 1e-12);
      marginal.log_determinant -= static_cast<double>(group.count) * std::log(weight);
    }
    precision.insert(precision.end(), group.count, weight);
    marginal.groups.push_back(std::move(group));
  }
  const auto columns = static_cast<Eigen::Index>(next);
  marginal.precision = Eigen::Map<Eigen::VectorXd>(precision.data(), columns);
  marginal.gram = Eigen::MatrixXd::Zero(columns, columns);
  marginal.moment = Eigen::VectorXd::Zero(columns);
  for (const CaptureEvidence& capture : evidence.captures) {
    marginal.captures.push_back(integratedOut(capture, split, marginal.log_determinant));
    const CaptureEvidence& there = marginal.captures.back();
    marginal.gram += there.gram, marginal.moment += there.moment;
    marginal.energy += there.energy, marginal.rows += there.rows;
  }
  return marginal;
}

Evidence RowSource::summed(std::span<const TermGroup> extra, std::span<const double> scales) const {
  const Marginal marginal = marginalise(withoutCatalogue(extra), scales);
  Evidence out{marginal.groups, {}};
  out.captures.push_back({marginal.gram, marginal.moment, marginal.energy, marginal.rows, "all", ""});
  return out;
}

Columns nuisanceColumns(const Marginal& marginal) {
  Columns columns;
  for (const Group& group : marginal.groups) {
    if (group.kind == Kind::Nuisance || group.kind == Kind::Shared || group.kind == Kind::Declared)
      append(columns, group);
  }
  return columns;
}

PseudoInverse pseudoInverse(const Eigen::MatrixXd& matrix, double tolerance) {
  PseudoInverse out;
  if (matrix.rows() == 0) return out;
  const Eigen::VectorXd root = matrix.diagonal().cwiseMax(0.0).cwiseSqrt();
  const double largest = root.maxCoeff();
  const Eigen::VectorXd shrink =
      root.unaryExpr([&](double size) { return size > 1e-14 * largest && size > 0.0 ? 1.0 / size : 0.0; });
  const auto [values, vectors] = linear::eigenpairs(shrink.asDiagonal() * matrix * shrink.asDiagonal());
  const Eigen::VectorXd inverse =
      values.unaryExpr([&](double value) { return value > tolerance ? 1.0 / value : 0.0; });
  out.rank = static_cast<int>((inverse.array() > 0.0).count());
  const Eigen::MatrixXd turned = shrink.asDiagonal() * vectors;
  out.inverse = linear::composed(turned, inverse);
  return out;
}

Fit fit(const Marginal& marginal, const Columns& columns) {
  Fit out;
  out.columns = columns;
  Eigen::MatrixXd gram = marginal.gram(columns, columns);
  gram.diagonal() += marginal.precision(columns);
  const Eigen::VectorXd moment = marginal.moment(columns);
  PseudoInverse inverse = pseudoInverse(gram);
  out.inverse = std::move(inverse.inverse);
  out.coefficient = out.inverse * moment;
  out.deviance = std::max(0.0, marginal.energy - moment.dot(out.coefficient));
  out.freedom = marginal.rows - inverse.rank;
  return out;
}

double energyLeft(const CaptureEvidence& capture, const Columns& columns, const Eigen::VectorXd& coefficient) {
  const Eigen::MatrixXd gram = capture.gram(columns, columns);
  const Eigen::VectorXd moment = capture.moment(columns), explained = gram * coefficient;
  return capture.energy - 2.0 * coefficient.dot(moment) + coefficient.dot(explained);
}

std::vector<double> estimateScales(const Evidence& evidence, std::span<const std::string> projected) {
  struct Class {
    double most = std::numeric_limits<double>::infinity(), alike = 1.0;
  };
  std::vector<Class> classes;
  for (const Group& group : evidence.groups) {
    if (group.kind != Kind::PerCapture && group.kind != Kind::Shared) continue;
    const auto which = static_cast<std::size_t>(group.scale_class);
    if (which >= classes.size()) classes.resize(which + 1);
    classes[which] = {std::min(classes[which].most, group.most_scale), group.alike};
  }
  std::vector<double> scale(classes.size(), 1.0);
  for (int round = 0; round < (scale.size() > 1 ? 2 : 1); ++round) {
    for (double& one : scale) {
      double best = one, least = criterion(evidence, projected, scale);
      for (const double candidate : kScales) {
        one = candidate;
        const double here = criterion(evidence, projected, scale);
        if (here < least - 1e-9) least = here, best = candidate;
      }
      one = best;
    }
  }
  for (std::size_t i = 0; i < scale.size(); ++i) scale[i] = std::min(classes[i].alike * scale[i], classes[i].most);
  return scale;
}

}  // namespace toftwin::discover
