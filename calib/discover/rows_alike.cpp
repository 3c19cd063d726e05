// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/rows_alike.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

namespace toftwin::discover {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kFewestRuns = 8;
constexpr Index kBand = 7, kLowBands = 20, kHighBands = 20;
/// Of seven exponential draws of mean 1: the mean of their median (1/4 + 1/5 + 1/6 + 1/7), and how many
/// draws' mean scatters as it does (the variance is the sum of these squares).
constexpr double kMedian = 0.7595, kWorth = 3.83;

struct Ordinate {
  double frequency = 0.0;  ///< radian per row
  double power = 0.0;      ///< of mean S(ω)
  double left = 1.0;       ///< share of it that the fit has not taken
};

/// Lowest frequencies, and as many spread over the others.
std::vector<Index> frequenciesOf(Index rows) {
  std::vector<Index> which;
  const Index all = (rows - 1) / 2, low = std::min(all, kBand * kLowBands);
  for (Index k = 1; k <= low; ++k) which.push_back(k);
  const Index high = std::min(all - low, kBand * kHighBands);
  for (Index i = 0; i < high; ++i) which.push_back(low + 1 + i * (all - low) / high);
  return which;
}

std::vector<Ordinate> periodogram(const VectorXd& residual, const MatrixXd& columns,
                                  const MatrixXd& inverse) {
  const Index n = residual.size();
  std::vector<Ordinate> ordinates;
  const double norm = std::sqrt(2.0 / static_cast<double>(n));
  for (const Index k : frequenciesOf(n)) {
    const double omega = 2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(n);
    MatrixXd wave(n, 2);
    for (Index i = 0; i < n; ++i) {
      wave(i, 0) = norm * std::cos(omega * static_cast<double>(i));
      wave(i, 1) = norm * std::sin(omega * static_cast<double>(i));
    }
    const MatrixXd taken = columns.transpose() * wave;
    const double left = 1.0 - 0.5 * (taken.cwiseProduct(inverse * taken)).sum();
    if (left < 0.2) continue;  // what little is left of it says nothing
    ordinates.push_back({omega, (wave.transpose() * residual).squaredNorm() / (2.0 * left), left});
  }
  return ordinates;
}

std::vector<Ordinate> bandsOf(const std::vector<Ordinate>& ordinates) {
  std::vector<Ordinate> bands;
  for (std::size_t first = 0; first + kBand <= ordinates.size(); first += kBand) {
    Ordinate band{0.0, 0.0, 0.0};
    std::array<double, kBand> power{};
    for (std::size_t i = 0; i < kBand; ++i) {
      const Ordinate& one = ordinates[first + i];
      power[i] = one.power;
      band.frequency += one.frequency / kBand, band.left += one.left / kBand;
    }
    std::ranges::nth_element(power, power.begin() + kBand / 2);
    band.power = power[kBand / 2] / kMedian;
    bands.push_back(band);
  }
  return bands;
}

/// −2 ln L with the variance profiled; a share q of it is AR(1) with correlation ρ from row to row.
double criterion(const std::vector<Ordinate>& bands, double q, double rho) {
  double weights = 0.0, powers = 0.0, logs = 0.0;
  for (const Ordinate& band : bands) {
    const double shape =
        1.0 - q + q * (1.0 - rho * rho) / (1.0 + rho * rho - 2.0 * rho * std::cos(band.frequency));
    weights += band.left, powers += band.left * band.power / shape, logs += band.left * std::log(shape);
  }
  return 2.0 * kWorth * (logs + weights * std::log(std::max(powers, 1e-300) / weights));
}

}  // namespace

std::vector<Runs> runsOfEqualValues(const TableData& data) {
  std::vector<Runs> found;
  for (const TableCovariate& covariate : data.covariates) {
    Runs runs{covariate.name, {}, 0};
    for (std::size_t i = 0; i < data.rows(); ++i) {
      const bool goes_on =
          i > 0 && covariate.values[i] == covariate.values[i - 1] && data.session[i] == data.session[i - 1];
      runs.count += !goes_on;
      runs.run.push_back(runs.count - 1);
    }
    const std::set<double> values(covariate.values.begin(), covariate.values.end());
    if (runs.count < kFewestRuns || 3 * static_cast<std::size_t>(runs.count) > data.rows()) continue;
    if (2 * values.size() >= static_cast<std::size_t>(runs.count)) found.push_back(std::move(runs));
  }
  std::ranges::stable_sort(found, {}, &Runs::count);
  return found;
}

double alikeness(const Runs& runs, const VectorXd& residual) {
  std::vector<double> sum(static_cast<std::size_t>(runs.count)), rows(sum.size());
  for (Index i = 0; i < residual.size(); ++i) {
    const auto run = static_cast<std::size_t>(runs.run[static_cast<std::size_t>(i)]);
    sum[run] += residual(i), rows[run] += 1.0;
  }
  double between = 0.0;
  for (std::size_t r = 0; r < sum.size(); ++r)
    if (rows[r] > 0.0) between += sum[r] * sum[r] / rows[r];
  const auto count = static_cast<double>(runs.count), freedom = static_cast<double>(residual.size()) - count;
  const double within = residual.squaredNorm() - between;
  if (!(within > 0.0) || freedom <= 0.0) return 0.0;
  return (between / count / (within / freedom) - 1.0) / std::sqrt(2.0 / count + 2.0 / freedom);
}

double correlationRows(const VectorXd& residual, const MatrixXd& columns, const MatrixXd& inverse) {
  const auto bands = bandsOf(periodogram(residual, columns, inverse));
  if (bands.size() < 3) return 1.0;
  // Two more numbers: by chance the criterion falls by 9.2 in one of a hundred (χ² with two degrees of
  // freedom).
  double least = criterion(bands, 0.0, 0.0) - 9.2, rows = 1.0;
  for (const double rho : {0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.97, 0.99}) {
    for (int tenths = 1; tenths <= 10; ++tenths) {
      const double q = 0.1 * tenths, here = criterion(bands, q, rho);
      if (here < least) least = here, rows = 1.0 - q + q * (1.0 + rho) / (1.0 - rho);
    }
  }
  return rows;
}

}  // namespace toftwin::discover
