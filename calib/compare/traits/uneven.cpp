// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/uneven.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <numeric>

#include "calib/compare/traits/linearised.h"
#include "calib/linear/linear.h"

namespace toftwin::compare {
namespace {

using Eigen::Index;

/// Columns of a parabola over each row's place in the order by x, −1 to 1, without its mean. Rows of one x are in no
/// order: they have their middle.
MatrixXd parabolaOver(Column x) {
  std::vector<double> sorted(x.begin(), x.end());
  std::ranges::sort(sorted);
  MatrixXd z(static_cast<Index>(x.size()), 2);
  for (Index i = 0; i < z.rows(); ++i) {
    const auto [from, to] = std::ranges::equal_range(sorted, x[static_cast<std::size_t>(i)]);
    const auto middle = 0.5 * static_cast<double>((from - sorted.begin()) + (to - sorted.begin()));
    const double place = 2.0 * middle / static_cast<double>(x.size()) - 1.0;
    z.row(i) << place, place * place;
  }
  return z.rowwise() - z.colwise().mean();
}

/// Half the square of what each row has less than the one before it over x: of what a curve misses, which would pass
/// for scatter, neighbours have the same.
VectorXd squaresBetweenNeighbours(Column left, Column x) {
  std::vector<std::size_t> order(left.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [x](std::size_t i) { return x[i]; });
  VectorXd squares(static_cast<Index>(left.size()));
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::size_t at = std::max<std::size_t>(i, 1);
    squares[static_cast<Index>(order[i])] = 0.5 * std::pow(left[order[at]] - left[order[at - 1]], 2);
  }
  return squares;
}

/// Koenker's n R² of the squares over the parabola. Each row is in two of them, which makes their means half as certain
/// again.
bool areUneven(const MatrixXd& z, const VectorXd& squares) {
  constexpr double kWrong = 0.1, kTogether = 1.5;
  const VectorXd about = squares.array() - squares.mean();
  const MatrixXd span = linear::basisOf(z);
  const VectorXd told = span * (span.transpose() * about);
  const double most = kTogether * boost::math::quantile(
      boost::math::complement(boost::math::chi_squared{static_cast<double>(z.cols())}, kWrong));
  return static_cast<double>(z.rows()) * told.squaredNorm() > most * about.squaredNorm();
}

/// Of normal rows: Fisher's scoring of their variances exp(z γ), on the mean 1. Rows that fit exactly by chance have no
/// weight of their own: σ stays within what a parabola may be.
VectorXd variancesBy(const MatrixXd& z, const VectorXd& squares) {
  constexpr int kRounds = 30;
  constexpr double kMost = 1.0, kNear = 1e-4;
  const linear::Ldlt normal{z.transpose() * z};
  VectorXd gamma = VectorXd::Zero(z.cols()), variance = VectorXd::Ones(z.rows());
  for (int round = 0; round < kRounds; ++round) {
    VectorXd relative = squares.cwiseQuotient(variance);
    relative /= relative.mean();
    VectorXd step = normal.solve(z.transpose() * (relative.array() - 1.0).matrix());
    step *= std::min(1.0, kMost / std::max(1e-300, step.cwiseAbs().maxCoeff()));
    gamma += step;
    variance = (z * gamma).array().exp();
    variance /= variance.mean();
    if (step.cwiseAbs().maxCoeff() < kNear) break;
  }
  return variance;
}

/// Ten rows to spare for each of the two numbers of a parabola.
bool areEnough(Column left, std::size_t parameters) { return left.size() >= parameters + 20; }

/// What rows leave, in the place of s².
struct ErrorsByRows {
  MatrixXd alike{};    ///< covariance of the parameters by one s² of all rows
  MatrixXd told{};     ///< by what each leaves
  VectorXd degrees{};  ///< of freedom, Satterthwaite's, of each parameter

  ErrorsByRows(const Fit& fit, const Model& model, Column y) {
    const MatrixXd j = jacobian(model, y.size(), fit.at);
    const Index n = j.rows(), k = j.cols();
    const MatrixXd inverse = linear::Ldlt{j.transpose() * j}.inverse(), from_rows = inverse * j.transpose();
    const VectorXd left = residuals(model, y, fit.at), own = (j * from_rows).diagonal().cwiseMin(0.99),
                   others = (1.0 - own.array()).matrix(), squares = left.cwiseAbs2().cwiseQuotient(others);
    alike = inverse * (left.squaredNorm() / static_cast<double>(n - k));
    told = from_rows * squares.asDiagonal() * from_rows.transpose();
    degrees = VectorXd(k);
    for (Index a = 0; a < k; ++a) {
      // Σ w r² of independent rows: its mean is Σ w (1 − h), its variance 2 Σ w w' P², P = 1 − J (JᵀJ)⁻¹ Jᵀ.
      const VectorXd weight = from_rows.row(a).transpose().cwiseAbs2().cwiseQuotient(others);
      const MatrixXd both = j.transpose() * weight.asDiagonal() * j * inverse;
      const double variance = weight.cwiseAbs2().dot((1.0 - 2.0 * own.array()).matrix()) + (both * both).trace();
      degrees[a] = std::pow(weight.dot(others), 2) / variance;
    }
  }
};

/// With Student's quantile of each parameter's own degrees of freedom.
void tellBy(const ErrorsByRows& by_rows, Fit& fit) {
  const Index k = by_rows.alike.rows();
  VectorXd wider(k);
  for (Index a = 0; a < k; ++a) wider[a] = studentT(by_rows.degrees[a]) / studentT(fit.degrees);
  const MatrixXd alike = linear::choleskyOf(by_rows.alike),
                 told = linear::choleskyOf(wider.asDiagonal() * by_rows.told * wider.asDiagonal());
  if (!alike.allFinite() || !told.allFinite()) return;
  const MatrixXd turn = told * linear::solveLowerEach(alike, MatrixXd::Identity(k, k));
  const auto turned = [&](std::vector<double>& covariance) {
    Eigen::Map<MatrixXd> one{covariance.data(), k, k};
    one = (turn * one * turn.transpose()).eval();
  };
  turned(fit.covariance);
  for (Fit::Possible& one : fit.possible) turned(one.covariance);
}

}  // namespace

std::vector<double> unevenSigmas(Column left, Column x, std::size_t parameters) {
  if (!areEnough(left, parameters) || !areUneven(parabolaOver(x), squaresBetweenNeighbours(left, x))) return {};
  return sigmasOver(left, x, parameters);
}

std::vector<double> sigmasOver(Column left, Column x, std::size_t parameters) {
  const MatrixXd z = parabolaOver(x);
  const VectorXd squares = Eigen::Map<const VectorXd>(left.data(), z.rows()).cwiseAbs2();
  if (!areEnough(left, parameters) || !(squares.mean() > 0.0)) return {};
  const VectorXd sigmas = variancesBy(z, squares).cwiseSqrt();
  if (!sigmas.allFinite() || !(sigmas.minCoeff() > 0.0)) return {};
  return {sigmas.data(), sigmas.data() + sigmas.size()};
}

void tellErrorsByRows(Fit& fit, const Model& model, Column y) { tellBy(ErrorsByRows{fit, model, y}, fit); }

void tellErrorsByRowsOfFew(Fit& fit, const Model& model, Column y) {
  constexpr double kFew = 10.0;
  const ErrorsByRows by_rows{fit, model, y};
  if (by_rows.degrees.minCoeff() < kFew) tellBy(by_rows, fit);
}

std::vector<double> over(Column values, Column sigmas) {
  std::vector<double> all(values.begin(), values.end());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] /= sigmas[i];
  return all;
}

Model over(const Model& model, Column sigmas) {
  return [&model, sigmas](std::span<const double> p, std::size_t i) { return model(p, i) / sigmas[i]; };
}

}  // namespace toftwin::compare
