// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/least_squares.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/beta.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>
#include <utility>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/linearised.h"
#include "calib/linear/linear.h"

namespace toftwin::compare {
namespace {

/// A step of a parameter for the numeric derivative: the cube root of the rounding, which balances it with
/// curvature.
double stepOf(double parameter) { return 6e-6 * std::max(std::abs(parameter), 1e-3); }

}  // namespace

double squaresOf(Column y) { return std::inner_product(y.begin(), y.end(), y.begin(), 0.0); }

VectorXd residuals(const Model& model, Column y, std::span<const double> p) {
  VectorXd r(static_cast<Eigen::Index>(y.size()));
  for (std::size_t i = 0; i < y.size(); ++i) r[static_cast<Eigen::Index>(i)] = y[i] - model(p, i);
  return r;
}

MatrixXd jacobian(const Model& model, std::size_t rows, std::vector<double> p) {
  MatrixXd jacobian(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(p.size()));
  for (std::size_t k = 0; k < p.size(); ++k) {
    const double at = p[k], step = stepOf(at);
    for (std::size_t i = 0; i < rows; ++i) {
      p[k] = at + step;
      const double above = model(p, i);
      p[k] = at - step;
      jacobian(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
          (above - model(p, i)) / (2.0 * step);
    }
    p[k] = at;
  }
  return jacobian;
}

namespace {

std::vector<double> moved(const std::vector<double>& p, const VectorXd& by) {
  std::vector<double> there = p;
  for (std::size_t k = 0; k < p.size(); ++k) there[k] += by[static_cast<Eigen::Index>(k)];
  return there;
}

/// (JᵀJ)⁻¹, or nothing where a column is zero or hangs on the others.
std::optional<MatrixXd> inverseOfNormal(const MatrixXd& j) {
  const VectorXd scale = j.colwise().norm();
  if (!scale.allFinite() || scale.minCoeff() <= 0.0) return std::nullopt;
  const MatrixXd unit = j * scale.cwiseInverse().asDiagonal();
  const auto [values, vectors] = linear::eigenpairs(unit.transpose() * unit);
  if (values.minCoeff() < 1e-10) return std::nullopt;
  const MatrixXd inverse = linear::composed(vectors, values.cwiseInverse());
  return MatrixXd{scale.cwiseInverse().asDiagonal() * inverse * scale.cwiseInverse().asDiagonal()};
}

}  // namespace

double studentT(double degrees, double level) {
  return boost::math::quantile(boost::math::students_t{std::max(1.0, degrees)}, 0.5 + 0.5 * level);
}

double Fit::varianceOf(std::span<const double> factor, std::size_t first) const {
  double variance = 0.0;
  for (std::size_t i = 0; i < factor.size(); ++i) {
    for (std::size_t k = 0; k < factor.size(); ++k)
      variance += factor[i] * factor[k] * covariance[(first + i) * at.size() + first + k];
  }
  return variance;
}

double Fit::bic() const {
  return deviance + static_cast<double>(at.size()) * std::log(static_cast<double>(n));
}

double Fit::error(std::size_t parameter) const {
  std::vector<double> gradient(at.size(), 0.0);
  gradient[parameter] = 1.0;
  return std::sqrt(varianceAlong(gradient));
}

Trait Fit::trait(std::string name, std::string unit, std::size_t parameter, double scale) const {
  return trait(std::move(name), std::move(unit),
               [=](std::span<const double> p) { return scale * p[parameter]; });
}

Trait Fit::trait(std::string name, std::string unit,
                 const std::function<double(std::span<const double>)>& of) const {
  std::vector<double> p = at, gradient;
  for (std::size_t k = 0; k < p.size(); ++k) {
    const double step = stepOf(at[k]);
    p[k] = at[k] + step;
    const double above = of(p);
    p[k] = at[k] - step;
    gradient.push_back((above - of(p)) / (2.0 * step));
    p[k] = at[k];
  }
  const double value = of(at), half = studentT(degrees) * std::sqrt(varianceAlong(gradient));
  return {.name = std::move(name),
          .unit = std::move(unit),
          .value = value,
          .low = value - half,
          .high = value + half,
          .n = n,
          .doubt = doubt,
          .odd_rows = odd_rows,
          .degrees = degrees};
}

void Fit::heedCorrelation(double rho) {
  if (rho <= 0.0) return;
  const double share = (1.0 - rho) / (1.0 + rho);
  const double parameters = static_cast<double>(at.size());
  const double fewer = std::max(1.0, static_cast<double>(n) * share - parameters);
  // The residual variance stays that of the rows; what falls is how many of them there are.
  for (double& c : covariance) c /= share;
  degrees = fewer;
}

std::optional<Fit> fitLeastSquares(const Model& model, Column y, std::vector<double> start) {
  if (y.size() <= start.size()) return std::nullopt;
  std::vector<double> p = std::move(start);
  VectorXd r = residuals(model, y, p);
  double damping = 1e-3;
  if (!r.allFinite()) return std::nullopt;
  for (int step = 0; step < 40; ++step) {
    const MatrixXd j = jacobian(model, y.size(), p);
    if (!j.allFinite()) return std::nullopt;
    const MatrixXd normal = j.transpose() * j;
    const VectorXd gradient = j.transpose() * r;
    bool is_better = false;
    double gain = 0.0;
    for (int attempt = 0; attempt < 30 && !is_better; ++attempt) {
      MatrixXd damped = normal;
      damped.diagonal() += damping * normal.diagonal().cwiseMax(1e-300);
      const auto there = moved(p, linear::Ldlt{damped}.solve(gradient));
      const VectorXd then = residuals(model, y, there);
      is_better = then.allFinite() && then.squaredNorm() <= r.squaredNorm();
      damping *= is_better ? 0.2 : 5.0;
      if (!is_better) continue;
      gain = r.squaredNorm() - then.squaredNorm();
      p = there;
      r = then;
    }
    // A standard error is worth 1/n of the squares: what is left to gain is far below one.
    if (!is_better || gain <= 1e-7 * r.squaredNorm()) break;
  }
  const auto inverse = inverseOfNormal(jacobian(model, y.size(), p));
  if (!inverse) return std::nullopt;
  Fit fit{.at = p,
          .covariance = {},
          .squares = r.squaredNorm(),
          .n = y.size(),
          .degrees = static_cast<double>(y.size() - p.size()),
          .free = static_cast<double>(y.size() - p.size()),
          .deviance = static_cast<double>(y.size()) * std::log(r.squaredNorm())};
  // Parameters of rows on an exact curve are known to rounding, not exactly: else a wave of 1e-16 would show.
  const double variance = std::max(fit.squares, kRoundingOfSquares * squaresOf(y)) / fit.degrees;
  for (std::size_t a = 0; a < p.size(); ++a) {
    for (std::size_t b = 0; b < p.size(); ++b)
      fit.covariance.push_back((*inverse)(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) * variance);
  }
  return fit;
}

double correlationOfResiduals(const Model& model, Column y, const Fit& fit) {
  const VectorXd r = residuals(model, y, fit.at);
  const double squares = r.squaredNorm();
  if (!(squares > 0.0)) return 0.0;
  const double rho = r.head(r.size() - 1).dot(r.tail(r.size() - 1)) / squares;
  const double n = static_cast<double>(y.size()), k = static_cast<double>(fit.at.size());
  // Each parameter takes about 1/n of correlation away (M. G. Kendall, Biometrika 41 (1954) 403, for the
  // mean).
  const double corrected = rho + k * (1.0 + rho) / n;
  return corrected > 2.0 / std::sqrt(n) ? std::min(corrected, 0.95) : 0.0;
}

void tellRoot(Trait& trait, double variance, double half) {
  trait.value = std::sqrt(std::max(0.0, variance));
  const double times = variance > 0.0 ? std::exp(0.5 * half / variance) : 0.0;
  trait.low = variance > 0.0 ? trait.value / times : 0.0;
  trait.high = variance > 0.0 ? trait.value * times : std::sqrt(std::max(0.0, variance + half));
}

Trait meanTrait(std::string name, std::string unit, Column values, double scale) {
  const Summary summary = summarise(values);
  const double half =
      summary.n < 2 ? std::nan("") : studentT(static_cast<double>(summary.n - 1)) * summary.standard_error;
  return {.name = std::move(name),
          .unit = std::move(unit),
          .value = scale * summary.mean,
          .low = scale * (summary.mean - half),
          .high = scale * (summary.mean + half),
          .n = summary.n,
          .degrees = static_cast<double>(std::max<std::size_t>(summary.n, 2) - 1)};
}

ShareInterval shareInterval(double events, double trials, ShareRule rule) {
  using Beta = boost::math::beta_distribution<>;
  const double others = trials - events;
  if (!(trials > 0.0)) return {};
  const double low_more = rule == ShareRule::Jeffreys ? 0.5 : 0.0,
               high_more = rule == ShareRule::Jeffreys ? 0.5 : 1.0;
  ShareInterval interval;
  if (events > 0.0) interval.low = boost::math::quantile(Beta{events + low_more, others + high_more}, 0.025);
  if (others > 0.0) interval.high = boost::math::quantile(Beta{events + high_more, others + low_more}, 0.975);
  return interval;
}

Result<std::vector<std::vector<double>>> finiteRows(const std::vector<Column>& columns, std::size_t least,
                                                    const char* of_what) {
  const std::size_t rows = columns.front().size();
  for (const Column& column : columns) {
    if (column.size() != rows)
      return Error{Error::Code::InvalidArgument,
                   fmt::format("{}: one column has {} rows, another {}", of_what, rows, column.size())};
  }
  std::vector<std::vector<double>> kept(columns.size());
  for (std::size_t i = 0; i < rows; ++i) {
    bool is_finite = true;
    for (const Column& column : columns) is_finite = is_finite && std::isfinite(column[i]);
    std::size_t c = 0;
    for (const Column& column : columns) {
      if (is_finite) kept[c].push_back(column[i]);
      ++c;
    }
  }
  if (kept.front().size() < least) {
    return Error{Error::Code::InvalidArgument, fmt::format("{}: {} of {} rows are finite, and it takes {}",
                                                           of_what, kept.front().size(), rows, least)};
  }
  return kept;
}

Error undetermined(const char* of_what, const char* why) {
  return {Error::Code::InvalidArgument, fmt::format("{}: these rows do not tell it: {}", of_what, why)};
}

}  // namespace toftwin::compare
