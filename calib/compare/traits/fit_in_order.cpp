// SPDX-License-Identifier: Apache-2.0
// Rows whose neighbours err alike: what is told of them is less certain than of as many independent ones.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "calib/compare/traits/linearised.h"
#include "calib/compare/traits/uneven.h"
#include "calib/linear/linear.h"

namespace toftwin::compare {
namespace {

/// So many rows more than parameters say something of how neighbours go with each other.
constexpr std::size_t kFewestFree = 12;
/// Nearer to 1 is a walk without a mean, of which no interval ends.
constexpr double kMostRho = 0.98;

using Order = std::vector<std::size_t>;

Order asTheyStand(std::size_t rows) {
  Order order(rows);
  std::iota(order.begin(), order.end(), std::size_t{0});
  return order;
}

/// The problem at its solution, rows in some order, as any ρ sees it. Whitened by ρ, the first row is
/// √(1 − ρ²) x₁ and each other one xᵢ − ρ xᵢ₋₁ (S. J. Prais, C. B. Winsten, Cowles Commission 383 (1954)), and
/// what least squares take of them is
///   M₀ − ρ M₁ + ρ² M₂,  M₀ = Σ xᵢxᵢᵀ,  M₁ = Σ xᵢxᵢ₋₁ᵀ + xᵢ₋₁xᵢᵀ,  M₂ = M₀ − x₁x₁ᵀ − xₙxₙᵀ
class Whitened {
 public:
  Whitened(const MatrixXd& jacobian, const VectorXd& left, const Order& order)
      : n_(left.size()), k_(jacobian.cols()), scale_(jacobian.colwise().norm().cwiseInverse()) {
    MatrixXd rows(n_, k_ + 1);
    for (Eigen::Index i = 0; i < n_; ++i) {
      const auto from = static_cast<Eigen::Index>(order[static_cast<std::size_t>(i)]);
      rows.row(i) << jacobian.row(from) * scale_.asDiagonal(), left[from];
    }
    m0_ = rows.transpose() * rows;
    const MatrixXd both = rows.bottomRows(n_ - 1).transpose() * rows.topRows(n_ - 1);
    m1_ = both + both.transpose();
    m2_ = m0_ - rows.row(0).transpose() * rows.row(0) - rows.row(n_ - 1).transpose() * rows.row(n_ - 1);
  }

  struct Seen {
    double log_likelihood = 0.0;  ///< restricted
    double deviance = 0.0;
    double variance = 0.0;        ///< of what is new in a row
    VectorXd step{};              ///< of the parameters
    MatrixXd covariance{};
  };
  [[nodiscard]] Seen by(double rho) const {
    const MatrixXd m = m0_ - rho * m1_ + rho * rho * m2_;
    const linear::Ldlt normal{m.topLeftCorner(k_, k_)};
    const VectorXd right = m.topRightCorner(k_, 1), step = normal.solve(right);
    const double free = static_cast<double>(n_ - k_),
                 squares = std::max(m(k_, k_) - right.dot(step), 1e-12 * m(k_, k_)),
                 log_det = normal.pivots().array().log().sum();
    const MatrixXd inverse = normal.inverse();
    return {.log_likelihood = -0.5 * (free * std::log(squares) + log_det - std::log(1.0 - rho * rho)),
            .deviance = static_cast<double>(n_) * std::log(squares) - std::log(1.0 - rho * rho),
            .variance = squares / free,
            .step = scale_.asDiagonal() * step,
            .covariance = scale_.asDiagonal() * inverse * scale_.asDiagonal() * (squares / free)};
  }

 private:
  Eigen::Index n_, k_;
  VectorXd scale_;
  MatrixXd m0_{}, m1_{}, m2_{};
};

/// ρ from which to which it is likely at all, in equal steps.
std::vector<double> likely(const Whitened& rows) {
  constexpr double kStep = 0.02, kUnlikely = 9.0;
  std::vector<double> rho, log_likelihood;
  for (double one = 0.0; one < kMostRho + 1e-9; one += kStep)
    rho.push_back(one), log_likelihood.push_back(rows.by(one).log_likelihood);
  const double most = std::ranges::max(log_likelihood);
  double from = kMostRho, to = 0.0;
  for (std::size_t i = 0; i < rho.size(); ++i) {
    if (!(log_likelihood[i] > most - kUnlikely)) continue;
    from = std::min(from, rho[i] - kStep), to = std::max(to, rho[i] + kStep);
  }
  from = std::max(from, 0.0), to = std::min(to, kMostRho);
  constexpr int kMany = 30;
  std::vector<double> fine;
  for (int i = 0; i <= kMany; ++i) fine.push_back(from + (to - from) * i / kMany);
  return fine;
}

struct Mixed {
  Fit fit{};
  double rho = 0.0;       ///< mean
  double evidence = 0.0;  ///< logarithm of the likelihood's mean over ρ
};

/// How likely each ρ is: beforehand a half for 0, and a half for all others, ¾ (1 − ρ²) each, of which those below 0
/// are taken for 0: that neighbours err oppositely makes no number surer. Without the one, few independent rows would
/// have the intervals of rows that may be a walk; without the other factor, ρ near 1 would be likely by no row, as
/// the restricted likelihood of a constant rises there without end.
std::vector<double> weightsOf(const std::vector<double>& rho, const std::vector<double>& log_likelihood) {
  const double step = rho[2] - rho[1], most = std::ranges::max(log_likelihood);
  std::vector<double> weights;
  for (std::size_t i = 0; i < rho.size(); ++i) {
    const double before = i == 0 ? 0.75 : 0.5 * 0.75 * (1.0 - rho[i] * rho[i]) * step;
    weights.push_back(before * std::exp(log_likelihood[i] - most));
  }
  return weights;
}

Mixed mixedOf(const Fit& at, const Whitened& rows) {
  std::vector<double> rho = likely(rows), log_likelihood;
  rho.insert(rho.begin(), 0.0);  // the one of independent rows
  std::vector<Whitened::Seen> seen;
  for (const double one : rho) seen.push_back(rows.by(one)), log_likelihood.push_back(seen.back().log_likelihood);
  const auto weights = weightsOf(rho, log_likelihood);
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  const auto k = static_cast<Eigen::Index>(at.at.size());
  Mixed mixed{.fit = at, .evidence = std::ranges::max(log_likelihood) + std::log(sum)};
  VectorXd mean = VectorXd::Zero(k);
  MatrixXd covariance = MatrixXd::Zero(k, k);
  double log_variance = 0.0;
  for (std::size_t i = 0; i < rho.size(); ++i) mean += weights[i] / sum * seen[i].step;
  for (std::size_t i = 0; i < rho.size(); ++i) {
    const double weight = weights[i] / sum, of_row = seen[i].variance / (1.0 - rho[i] * rho[i]);
    const VectorXd away = seen[i].step - mean;
    const MatrixXd& c = seen[i].covariance;  // symmetric: either order of its elements
    mixed.rho += weight * rho[i], log_variance += weight * std::log(of_row);
    covariance += weight * (c + away * away.transpose());
    constexpr double kNegligible = 1e-6;
    if (weight < kNegligible) continue;
    mixed.fit.possible.push_back(
        {weight, {away.data(), away.data() + k}, {c.data(), c.data() + c.size()}, of_row});
  }
  for (Eigen::Index i = 0; i < k; ++i) mixed.fit.at[static_cast<std::size_t>(i)] += mean[i];
  mixed.fit.covariance.assign(covariance.data(), covariance.data() + covariance.size());
  mixed.fit.squares = std::exp(log_variance) * mixed.fit.degrees;
  mixed.fit.deviance = std::ranges::min(seen, {}, &Whitened::Seen::deviance).deviance;
  return mixed;
}

Mixed mixedOf(const Fit& at, const Model& model, Column y, const Order& order) {
  return mixedOf(at, {jacobian(model, y.size(), at.at), residuals(model, y, at.at), order});
}

/// The model's rows whitened by one ρ: where it bends, its solution is elsewhere than that of independent rows.
std::optional<Fit> fitBy(double rho, const Model& model, Column y, const Order& order, const Fit& from) {
  const double first = std::sqrt(1.0 - rho * rho);
  const auto whitened = [&](auto&& row, std::size_t i) {
    return i == 0 ? first * row(order[0]) : row(order[i]) - rho * row(order[i - 1]);
  };
  std::vector<double> white;
  for (std::size_t i = 0; i < y.size(); ++i)
    white.push_back(whitened([&](std::size_t at) { return y[at]; }, i));
  const Model white_model = [&](std::span<const double> p, std::size_t i) {
    return whitened([&](std::size_t at) { return model(p, at); }, i);
  };
  return fitLeastSquares(white_model, white, from.at);
}

/// A number as one ρ has it: so far from the mean of all, with such a standard error.
struct Told {
  double weight = 0.0, away = 0.0, error = 0.0;
};

/// Student's distribution for 12 degrees of freedom and more (M. Abramowitz, I. A. Stegun, 26.7.8), to 10⁻³ of its
/// tails: it is asked thousands of times for one number.
double studentBelow(double t, double degrees) {
  const double normal = t * (1.0 - 0.25 / degrees) / std::sqrt(1.0 + 0.5 * t * t / degrees);
  return 0.5 * std::erfc(-normal / std::numbers::sqrt2);
}

/// Half of the interval about 0 that holds Student's numbers of all ρ together with 95 %.
double halfOf(const std::vector<Told>& all, double degrees) {
  const auto within = [&](double half) {
    double held = 0.0, sum = 0.0;
    for (const Told& one : all) {
      held += one.weight * (studentBelow((half - one.away) / one.error, degrees) -
                            studentBelow((-half - one.away) / one.error, degrees));
      sum += one.weight;
    }
    return held / sum;
  };
  double low = 0.0, high = 0.0;
  for (const Told& one : all) high = std::max(high, std::abs(one.away) + studentT(degrees) * one.error);
  constexpr int kHalvings = 20;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (within(middle) < 0.95 ? low : high) = middle;
  }
  return high;
}

/// Whether a curve by neighbours' correlation leaves clearly more of the rows than least squares do: errors that go
/// on so far are taken for a walk, and what they go on about is none of the curve's business.
bool isBeside(const Fit& mixed, const Fit& alone, const Model& model, Column y) {
  constexpr double kClearly = 1.4;
  return residuals(model, y, mixed.at).norm() > kClearly * std::sqrt(alone.squares);
}

/// Least squares of rows that may not be of one population: as uncertain as neighbours' residuals say, and in doubt.
Fit inDoubt(Fit fit, const Model& model, Column y, const Order& order, double left_else) {
  const VectorXd left = residuals(model, y, fit.at);
  double together = 0.0;
  for (std::size_t i = 1; i < order.size(); ++i)
    together += left[static_cast<Eigen::Index>(order[i])] * left[static_cast<Eigen::Index>(order[i - 1])];
  fit.doubt = fmt::format(
      "neighbours err so much alike that a curve by that leaves {:.1f} times what least squares leave: rows may be of "
      "more than one population, such as two sessions",
      left_else / left.norm());
  fit.heedCorrelation(std::min(together / left.squaredNorm(), 0.95));
  return fit;
}

/// fitInOrder() of rows that scatter evenly.
std::optional<Fit> fitEvenly(const Model& model, Column y, std::vector<double> start, Column x) {
  auto fit = fitLeastSquares(model, y, std::move(start));
  if (!fit || fit->degrees < static_cast<double>(kFewestFree)) return fit;
  // What is left of an exact curve says nothing of errors.
  if (!(fit->squares > kRoundingOfSquares * squaresOf(y))) return fit;
  Order order = asTheyStand(y.size());
  Mixed mixed = mixedOf(*fit, model, y, order);
  if (!x.empty()) {
    Order over_x = order;
    std::ranges::stable_sort(over_x, {}, [x](std::size_t i) { return x[i]; });
    if (over_x != order) {
      Mixed other = mixedOf(*fit, model, y, over_x);
      if (other.evidence > mixed.evidence) mixed = std::move(other), order = std::move(over_x);
    }
  }
  constexpr double kNone = 0.05;  // so little moves no solution
  if (std::abs(mixed.rho) > kNone) {
    if (const auto again = fitBy(mixed.rho, model, y, order, *fit))
      mixed = mixedOf(*again, model, y, order);
  }
  if (!isBeside(mixed.fit, *fit, model, y)) return std::move(mixed.fit);
  fit->deviance = mixed.fit.deviance;
  return inDoubt(std::move(*fit), model, y, order, residuals(model, y, mixed.fit.at).norm());
}

}  // namespace

double Fit::varianceAlong(std::span<const double> gradient) const {
  const auto along = [&](const std::vector<double>& c) {
    double variance = 0.0;
    for (std::size_t a = 0; a < gradient.size(); ++a) {
      for (std::size_t b = 0; b < gradient.size(); ++b)
        variance += gradient[a] * gradient[b] * c[a * at.size() + b];
    }
    return std::max(0.0, variance);
  };
  std::vector<Told> all;
  for (const Possible& one : possible) {
    const double error = std::sqrt(along(one.covariance));
    if (!(error > 0.0)) continue;
    all.push_back({one.weight, std::inner_product(gradient.begin(), gradient.end(), one.away.begin(), 0.0), error});
  }
  if (all.empty()) return along(covariance);
  return std::pow(halfOf(all, degrees) / studentT(degrees), 2);
}

double Fit::degreesOfRow() const {
  double mean = 0.0, mean_square = 0.0;
  for (const Possible& one : possible) {
    const double log_variance = std::log(one.variance);
    mean += one.weight * log_variance, mean_square += one.weight * log_variance * log_variance;
  }
  return even_share * 2.0 / (2.0 / degrees + std::max(0.0, mean_square - mean * mean));
}

std::optional<Fit> fitOver(Column sigmas, const Model& model, Column y, std::vector<double> start, Column x) {
  auto fit = fitEvenly(over(model, sigmas), over(y, sigmas), std::move(start), x);
  if (!fit) return fit;
  double log_sigmas = 0.0, fourth = 0.0;
  for (const double one : sigmas) log_sigmas += std::log(one), fourth += std::pow(one, 4);
  fit->deviance += 2.0 * log_sigmas;
  fit->even_share = static_cast<double>(y.size()) / fourth;
  return fit;
}

std::optional<Fit> fitInOrder(const Model& model, Column y, std::vector<double> start, Column x) {
  auto fit = fitEvenly(model, y, std::move(start), x);
  // Few rows, those of an exact curve and those in doubt say nothing of their σ.
  if (!fit || x.empty() || fit->possible.empty()) return fit;
  constexpr int kRounds = 3;  // each is nearer to the rows' σ and to the curve
  std::optional<Fit> by_sigma;
  std::vector<double> sigmas;
  for (int round = 0; round < kRounds; ++round) {
    const Fit& last = by_sigma ? *by_sigma : *fit;
    const VectorXd left = residuals(model, y, last.at);
    auto next_sigmas = unevenSigmas({left.data(), left.data() + left.size()}, x, last.at.size());
    if (next_sigmas.empty()) break;
    auto next = fitOver(next_sigmas, model, y, last.at, x);
    if (!next) break;
    by_sigma = std::move(next), sigmas = std::move(next_sigmas);
  }
  if (!by_sigma) {
    tellErrorsByRowsOfFew(*fit, model, y);
    return fit;
  }
  tellErrorsByRows(*by_sigma, over(model, sigmas), over(y, sigmas));
  return by_sigma;
}

}  // namespace toftwin::compare
