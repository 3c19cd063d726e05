// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/waves.h"

#include <fmt/format.h>
#include <toftwin/units.h>

#include <Eigen/Core>
#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/non_central_f.hpp>
#include <cmath>
#include <numbers>

#include "calib/compare/statistics.h"
#include "calib/linear/linear.h"

namespace toftwin::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kSameWave = 1e-3;     ///< over 8 m of a wave of 0.3 m, 0.2 rad
constexpr double kMostOfItself = 0.5;  ///< more of a wave as large, and it may be that one

bool areTheSame(const Wave& a, const Wave& b) { return std::abs(a.per_m - b.per_m) < kSameWave * b.per_m; }

/// cos and sin of each, side by side.
MatrixXd partsOf(const std::vector<Wave>& waves, Column distance_m) {
  MatrixXd parts(static_cast<Index>(distance_m.size()), static_cast<Index>(2 * waves.size()));
  for (Index w = 0; w < parts.cols() / 2; ++w) {
    const double per_m = waves[static_cast<std::size_t>(w)].per_m;
    for (Index i = 0; i < parts.rows(); ++i) {
      const double phase = per_m * distance_m[static_cast<std::size_t>(i)];
      parts(i, 2 * w) = std::cos(phase), parts(i, 2 * w + 1) = std::sin(phase);
    }
  }
  return parts;
}

MatrixXd withLine(Column distance_m) {
  MatrixXd line(static_cast<Index>(distance_m.size()), 2);
  line.col(0).setOnes();
  for (Index i = 0; i < line.rows(); ++i) line(i, 1) = distance_m[static_cast<std::size_t>(i)];
  return line;
}

/// Covariance of `count` parameters from the first one on.
MatrixXd covarianceOf(const Fit& fit, std::size_t first, Index count) {
  const auto along = [&](Index i, Index j) {
    std::vector<double> factor(static_cast<std::size_t>(count), 0.0);
    factor[static_cast<std::size_t>(i)] += 1.0, factor[static_cast<std::size_t>(j)] += i == j ? 0.0 : 1.0;
    return fit.varianceOf(factor, first);
  };
  MatrixXd covariance(count, count);
  for (Index i = 0; i < count; ++i) covariance(i, i) = along(i, i);
  for (Index i = 0; i < count; ++i) {
    for (Index j = 0; j < i; ++j)
      covariance(i, j) = covariance(j, i) = 0.5 * (along(i, j) - covariance(i, i) - covariance(j, j));
  }
  return covariance;
}

/// The noncentrality by which a share of all runs shows an F below `seen`; 0 where even none does.
double noncentrality(double degrees, double of_error, double seen, double share) {
  const auto below = [&](double wanted) {
    return boost::math::cdf(boost::math::non_central_f{degrees, of_error, std::max(wanted, 1e-9)}, seen);
  };
  double low = 0.0, high = 4.0 * degrees * (seen + 10.0);
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    (below(middle) > share ? low : high) = middle;
  }
  return low;
}

/// βᵀQβ, and what of it errors of β make.
struct Power {
  double seen = 0.0, by_errors = 0.0, degrees = 0.0;
  double along = 0.0;  ///< variance of √(βᵀQβ)
  double of_error = 0.0;

  /// Verdicts widen the interval by a factor, which of few degrees is too little near 0: what errors alone show in
  /// more than 0.07 % of runs, by which 70 rows hold together, is none.
  [[nodiscard]] bool isCertain() const {
    constexpr double kOfAllRows = 7e-4;
    const boost::math::fisher_f errors{degrees, of_error};
    return boost::math::cdf(complement(errors, seen / by_errors)) < kOfAllRows;
  }
  /// Less than errors alone show on the mean does not prove that there is less than nothing.
  [[nodiscard]] Trait trait(double rows) const {
    const double value = std::sqrt(std::max(0.0, seen - by_errors)), half = studentT(of_error) * std::sqrt(along);
    Trait all{.name = kWavesTogether, .unit = "mm", .value = value, .low = value - half, .high = value + half};
    constexpr double kFar = 10.0;  // standard errors, from where on the delta method is as good
    if (value * value <= kFar * kFar * along || seen <= kFar * by_errors) {
      const double each = by_errors / degrees, f = seen / by_errors;
      all.low = isCertain() ? std::sqrt(each * noncentrality(degrees, of_error, f, 0.975)) : 0.0;
      all.high = std::sqrt(each * noncentrality(degrees, of_error, std::max(f, 1.0), 0.025));
    }
    for (double* one : {&all.value, &all.low, &all.high}) *one /= std::sqrt(rows);
    return all;
  }
};

/// Those that are no other name of a fitted one.
std::vector<Wave> othersThan(const std::vector<Wave>& fitted, const std::vector<Wave>& left_out) {
  std::vector<Wave> others;
  for (const Wave& one : left_out) {
    if (std::ranges::none_of(fitted, [&](const Wave& there) { return areTheSame(there, one); }))
      others.push_back(one);
  }
  return others;
}

/// What least squares of c + s d + the fitted waves make of each part of the others, a column for each. The distances
/// are less `from_m`, where c is told.
MatrixXd shownBy(const std::vector<Wave>& fitted, const std::vector<Wave>& others, Column distance_m,
                 double from_m) {
  MatrixXd model(static_cast<Index>(distance_m.size()), static_cast<Index>(2 + 2 * fitted.size()));
  model.leftCols(2) = withLine(distance_m), model.rightCols(model.cols() - 2) = partsOf(fitted, distance_m);
  model.col(1).array() -= from_m;
  return linear::leastSquares(model, partsOf(others, distance_m));
}

}  // namespace

std::optional<Trait> wavesTogether(const Fit& fit, std::size_t first, const std::vector<Wave>& waves,
                                   Column distance_m) {
  const auto count = static_cast<Index>(2 * waves.size());
  if (count == 0 || fit.at.size() < first + 2 * waves.size()) return std::nullopt;
  const MatrixXd line = withLine(distance_m), all = partsOf(waves, distance_m);
  const MatrixXd parts = all - line * linear::leastSquares(line, all);
  const MatrixXd q = parts.transpose() * parts, v = covarianceOf(fit, first, count), qv = q * v;
  const auto at = Eigen::Map<const Eigen::VectorXd>(fit.at.data() + first, count);
  const double seen = at.dot(q * at), by_errors = qv.trace(), squares = (qv * qv).trace();
  if (!(by_errors > 0.0 && squares > 0.0 && seen > 0.0)) return std::nullopt;
  Trait together = Power{.seen = seen,
                         .by_errors = by_errors,
                         .degrees = by_errors * by_errors / squares,
                         .along = (q * at).dot(v * (q * at)) / seen,
                         .of_error = fit.degrees}
                       .trait(static_cast<double>(distance_m.size()));
  together.n = fit.n;
  return together;
}

std::vector<Wave> wavesOf(std::span<const double> frequency_hz, std::span<const int> orders) {
  std::vector<Wave> waves;
  for (const double f : frequency_hz) {
    for (const int k : orders) {
      const Wave one{2.0 * std::numbers::pi * k * 2.0 * f / kSpeedOfLight_m_per_s,
                     fmt::format("{:.6g} MHz, {} per period", f * 1e-6, k)};
      const auto same =
          std::ranges::find_if(waves, [&](const Wave& there) { return areTheSame(there, one); });
      if (same == waves.end())
        waves.push_back(one);
      else
        same->name += " = " + one.name;  // 3 of 80 MHz and 2 of 120 MHz are one wave
    }
  }
  return waves;
}

std::vector<std::string> doubtsOf(const std::vector<Wave>& fitted, const std::vector<Wave>& left_out,
                                  Column distance_m) {
  const std::vector<Wave> others = othersThan(fitted, left_out);
  std::vector<std::string> doubts(fitted.size());
  const auto n = static_cast<Index>(distance_m.size()), waves = static_cast<Index>(2 * fitted.size());
  if (others.empty()) return doubts;
  if (n < waves + 2) {  // fewer than it takes to fit them: nothing can be said for them
    std::ranges::fill(
        doubts, fmt::format("it may be a wave of {}: {} rows do not tell them", others.front().name, n));
    return doubts;
  }
  const MatrixXd shown = shownBy(fitted, others, distance_m, 0.0);
  for (std::size_t w = 0; w < fitted.size(); ++w) {
    double most = kMostOfItself;
    for (std::size_t k = 0; k < others.size(); ++k) {
      // Of all phases the one that does most: the 2 × 2 block's largest singular value.
      const Eigen::Matrix2d block =
          shown.block<2, 2>(static_cast<Index>(2 + 2 * w), static_cast<Index>(2 * k));
      const double share = std::sqrt(linear::eigenvalues(block.transpose() * block).maxCoeff());
      if (!(share > most)) continue;
      most = share;
      doubts[w] = fmt::format(
          "it may be a wave of {}, which these distances do not tell, and of which {:.2g} would show as it",
          others[k].name, share);
    }
  }
  return doubts;
}

ShownInOffsetAndScale shownInLine(const std::vector<Wave>& fitted, const std::vector<Wave>& left_out,
                                  Column distance_m) {
  const std::vector<Wave> others = othersThan(fitted, left_out);
  ShownInOffsetAndScale all;
  if (others.empty() || distance_m.size() < 2 + 2 * fitted.size()) return all;
  const MatrixXd shown = shownBy(fitted, others, distance_m, summarise(distance_m).mean);
  const auto keepMost = [&](ShownInLine& line, Index row, std::size_t k) {
    const double share = shown.block<1, 2>(row, static_cast<Index>(2 * k)).norm();
    if (share > line.most) line = {share, others[k].name};
  };
  for (std::size_t k = 0; k < others.size(); ++k) keepMost(all.offset, 0, k), keepMost(all.scale, 1, k);
  return all;
}

}  // namespace toftwin::compare
