// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/row_dependence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "calib/linear/linear.h"

namespace toftwin::discover {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Never 1: rows of the same moment would then have to be equal.
constexpr std::array kShares{0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95};
constexpr std::array kNeighbours{0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.97, 0.99};
constexpr double kLeastWeight = 1e-3;

std::optional<RowClock> clockOf(const TableData& data, const std::string& name,
                                const std::vector<double>& at) {
  RowClock clock{name, std::vector<Index>(data.rows()), {}};
  std::iota(clock.order.begin(), clock.order.end(), Index{0});
  const auto place = [&](Index row) {
    const auto i = static_cast<std::size_t>(row);
    return std::pair{data.session[i], at[i]};
  };
  std::ranges::stable_sort(clock.order, {}, place);
  std::vector<double> steps;
  for (std::size_t i = 0; i < clock.order.size(); ++i) {
    const auto here = place(clock.order[i]);
    const auto before = i > 0 ? place(clock.order[i - 1]) : std::pair{-1, 0.0};
    const bool goes_on = here.first == before.first;
    clock.step.push_back(goes_on ? here.second - before.second : std::numeric_limits<double>::infinity());
    if (goes_on && clock.step.back() > 0.0) steps.push_back(clock.step.back());
  }
  if (steps.empty()) return std::nullopt;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::ranges::nth_element(steps, middle);
  for (double& step : clock.step) step /= *middle;
  return clock;
}

struct Restricted {
  double criterion = 0.0;  ///< −2 ln of the restricted likelihood, the variance profiled
  double variance = 1.0;
};

Restricted restricted(const VectorXd& y, const MatrixXd& x, double log_determinant) {
  const MatrixXd lower = linear::choleskyOf(x.transpose() * x);
  const VectorXd explained = linear::solveLower(lower, x.transpose() * y);
  const auto freedom = static_cast<double>(y.size() - x.cols());
  const double variance = std::max((y.squaredNorm() - explained.squaredNorm()) / freedom, 1e-300);
  log_determinant += 2.0 * lower.diagonal().array().log().sum();
  return {log_determinant + freedom * std::log(variance), variance};
}

Restricted restricted(const VectorXd& y, const MatrixXd& x, const RowWhitening& whitening) {
  return restricted(whitening.whitened(y), whitening.whitened(x), whitening.logDeterminant());
}

struct Tried {
  RowCorrelation correlation;
  double criterion = 0.0, variance = 1.0;
};

std::vector<Tried> triedWith(const RowClock& clock, const VectorXd& y, const MatrixXd& x) {
  const Restricted white = restricted(y, x, 0.0);
  std::vector<Tried> all{{{}, white.criterion, white.variance}};
  for (const double share : kShares) {
    for (const double neighbour : kNeighbours) {
      const RowCorrelation correlation{share, neighbour};
      const Restricted here = restricted(y, x, RowWhitening{clock, correlation});
      all.push_back({correlation, here.criterion, here.variance});
    }
  }
  return all;
}

}  // namespace

std::vector<RowClock> clocksOf(const TableData& data) {
  std::vector<RowClock> clocks;
  const auto add = [&](const std::string& name, const std::vector<double>& at) {
    if (auto clock = clockOf(data, name, at)) clocks.push_back(*std::move(clock));
  };
  add("", {data.line.begin(), data.line.end()});
  for (const TableCovariate& covariate : data.covariates)
    if (covariate.nature == Nature::Time) add(covariate.name, covariate.values);
  return clocks;
}

RowWhitening::RowWhitening(const RowClock& clock, const RowCorrelation& correlation) {
  const double q = correlation.share;
  double variance = q;  // of the process, given the rows so far
  for (std::size_t i = 0; i < clock.order.size(); ++i) {
    const double decay = std::pow(correlation.neighbour, clock.step[i]);
    const double before = decay * decay * variance + q * (1.0 - decay * decay);
    const double of_row = before + 1.0 - q;
    steps_.push_back({clock.order[i], decay, before / of_row, std::sqrt(of_row)});
    variance = before * (1.0 - q) / of_row;
  }
}

MatrixXd RowWhitening::whitened(const MatrixXd& rows) const {
  MatrixXd out(rows.rows(), rows.cols());
  for (Index column = 0; column < rows.cols(); ++column) {
    double process = 0.0;
    for (const Step& step : steps_) {
      const double expected = step.decay * process, news = rows(step.row, column) - expected;
      out(step.row, column) = news / step.deviation;
      process = expected + step.gain * news;
    }
  }
  return out;
}

MatrixXd RowWhitening::coloured(const MatrixXd& rows) const {
  MatrixXd out(rows.rows(), rows.cols());
  for (Index column = 0; column < rows.cols(); ++column) {
    double process = 0.0;
    for (const Step& step : steps_) {
      const double expected = step.decay * process, news = step.deviation * rows(step.row, column);
      out(step.row, column) = expected + news;
      process = expected + step.gain * news;
    }
  }
  return out;
}

double RowWhitening::logDeterminant() const {
  double sum = 0.0;
  for (const Step& step : steps_) sum += 2.0 * std::log(step.deviation);
  return sum;
}

std::optional<RowDependence> dependenceOf(const std::vector<RowClock>& clocks, const VectorXd& y,
                                          const MatrixXd& columns) {
  const MatrixXd x = linear::basisOf(columns);
  if (y.size() <= x.cols()) return std::nullopt;
  double least = std::numeric_limits<double>::infinity();
  const RowClock* clock = nullptr;
  std::vector<Tried> tried;
  for (const RowClock& one : clocks) {
    std::vector<Tried> here = triedWith(one, y, x);
    const double most_likely = std::ranges::min(here, {}, &Tried::criterion).criterion;
    if (most_likely < least) least = most_likely, clock = &one, tried = std::move(here);
  }
  if (clock == nullptr) return std::nullopt;
  RowDependence found{*clock, {}, tried.front().criterion - least, tried.front().variance, {}};
  double sum = 0.0;
  for (const Tried& one : tried) {
    const double weight = std::exp(0.5 * (least - one.criterion));
    if (weight < kLeastWeight) continue;
    found.likely.push_back({one.correlation, weight, one.variance});
    sum += weight;
  }
  for (LikelyCorrelation& one : found.likely) one.weight /= sum;
  found.best = std::ranges::max(found.likely, {}, &LikelyCorrelation::weight);
  return found;
}

}  // namespace toftwin::discover
