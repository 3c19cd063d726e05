// SPDX-License-Identifier: Apache-2.0
#include "calib/loop/no_readings.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "calib/loop/noise.h"
#include "calib/loop/projection.h"

namespace toftwin::loop {
namespace {

/// Far rows are so many deviations of the others away, and so many times farther than the farthest of the others: no tail that
/// rows come from one by one has such a gap.
constexpr double kFar = 10.0, kGap = 2.5;
/// More than so many are no exceptions.
constexpr double kMostFar = 0.4;
/// What says in so many of its rows that they are far, and of the far rows holds as many, is what they go with.
constexpr double kSays = 0.9;

/// A line through pairs of rows drawn at random whose median error is least [Rousseeuw 1984]: nearly half of the rows may be far.
Eigen::VectorXd besideRobustLine(const Evidence& evidence) {
  const Eigen::VectorXd& y = evidence.y;
  Eigen::VectorXd left = y.array() - median({y.begin(), y.end()});
  if (evidence.reference.size() == 0) return left;
  std::mt19937_64 random{7};
  double least = robustScale(left);
  const auto n = static_cast<std::uint64_t>(y.size());
  for (int draw = 0; draw < 300; ++draw) {
    const auto i = static_cast<Eigen::Index>(random() % n), j = static_cast<Eigen::Index>(random() % n);
    const double apart = evidence.reference[i] - evidence.reference[j];
    if (apart == 0.0) continue;
    const double slope = (y[i] - y[j]) / apart;
    Eigen::VectorXd r = y - slope * evidence.reference;
    r.array() -= median({r.begin(), r.end()});
    const double scale = robustScale(r);
    if (scale < least) least = scale, left = r;
  }
  return left;
}

/// Beside a flexible model of the rows that are not far, found by turns.
Eigen::VectorXd besideFlexible(const Evidence& evidence) {
  Eigen::VectorXd left = besideRobustLine(evidence);
  Eigen::MatrixXd columns = flexibleColumns(evidence);
  Eigen::MatrixXd all(evidence.rows(), columns.cols() + 1);
  all << Eigen::VectorXd::Ones(evidence.rows()), columns;
  const Evidence one = ungrouped(evidence);
  for (int turn = 0; turn < 8; ++turn) {
    const double limit = 6.0 * std::max(1e-300, robustScale(left));
    const Eigen::VectorXd weight = (left.array().abs() <= limit).select(Eigen::VectorXd::Ones(left.size()), 1e-9);
    const LeastSquares fit = leastSquares(one, evidence.y, weight, columns);
    left = fit.residual;
    // Offsets are of the rows that count.
    std::vector<double> near;
    for (Eigen::Index i = 0; i < left.size(); ++i)
      if (weight[i] == 1.0) near.push_back(left[i]);
    left.array() -= median(std::move(near));
  }
  return left;
}

std::vector<bool> farRows(const Eigen::VectorXd& left) {
  std::vector<double> size;
  for (const double r : left) size.push_back(std::abs(r));
  std::ranges::sort(size);
  const double scale = robustScale(left);
  const auto first = static_cast<std::size_t>((1.0 - kMostFar) * static_cast<double>(size.size()));
  double limit = INFINITY, widest = kGap;
  for (std::size_t i = std::max<std::size_t>(1, first); i < size.size(); ++i) {
    const double gap = size[i] / std::max(1e-300, std::max(size[i - 1], 3.0 * scale));
    if (size[i] > kFar * scale && gap > widest) widest = gap, limit = size[i];
  }
  std::vector<bool> far;
  for (const double r : left) far.push_back(std::abs(r) >= limit);
  return far;
}

/// Whether rows for which `isOne` holds are the far ones, nearly all of both.
template <class Predicate>
bool says(const std::vector<bool>& far, Predicate isOne) {
  double both = 0.0, ones = 0.0, fars = 0.0;
  for (std::size_t i = 0; i < far.size(); ++i) {
    const bool one = isOne(static_cast<Eigen::Index>(i));
    both += one && far[i] ? 1.0 : 0.0, ones += one ? 1.0 : 0.0, fars += far[i] ? 1.0 : 0.0;
  }
  return ones >= 3.0 && both >= kSays * ones && both >= kSays * fars;
}

/// A value, a class of whole numbers or a place that says which rows are far.
bool isSaid(const std::vector<bool>& far, const Covariate& c) {
  if (c.is_reference) return false;
  if (c.sorted.size() <= 64) {
    for (const double value : c.sorted)
      if (says(far, [&](Eigen::Index i) { return c.x[i] == value; })) return true;
  }
  if (c.nature == table::Nature::Category) return false;
  if (c.nature == table::Nature::Index) {
    for (int m = 2; m <= 64; ++m)
      for (int k = 0; k < m; ++k)
        if (says(far, [&](Eigen::Index i) { return std::fmod(std::floor(c.x[i]), m) == k; })) return true;
  }
  double low = INFINITY, high = -INFINITY;
  for (std::size_t i = 0; i < far.size(); ++i)
    if (far[i]) low = std::min(low, c.x[static_cast<Eigen::Index>(i)]), high = std::max(high, c.x[static_cast<Eigen::Index>(i)]);
  return says(far, [&](Eigen::Index i) { return c.x[i] >= low && c.x[i] <= high; });
}

struct Span {
  double low = INFINITY, high = -INFINITY;
  void add(double x) { low = std::min(low, x), high = std::max(high, x); }
  [[nodiscard]] double width() const { return high - low; }
};

/// Of far rows: stuck, wrapped or just far.
NoReadings named(const Evidence& evidence, const Eigen::VectorXd& measured, const Eigen::VectorXd& left, const std::vector<bool>& far) {
  NoReadings found{.kind = NoReading::Far};
  Span values, shifts, references, near_values;
  for (Eigen::Index i = 0; i < left.size(); ++i) {
    if (!far[static_cast<std::size_t>(i)]) {
      if (measured.size() > 0) near_values.add(measured[i]);
      continue;
    }
    found.rows.push_back(i);
    shifts.add(left[i]);
    if (measured.size() > 0) values.add(measured[i]);
    if (evidence.reference.size() > 0) references.add(evidence.reference[i]);
  }
  found.low = shifts.low, found.high = shifts.high;
  if (found.rows.size() < 3 || measured.size() == 0 || evidence.reference.size() == 0) return found;
  if (references.width() > 0.0 && values.width() < 0.2 * references.width()) {
    found.kind = NoReading::Stuck, found.low = values.low, found.high = values.high;
    return found;
  }
  // Too short by one length, and all others end before it: as a phase that has gone round.
  const double length = -0.5 * (shifts.low + shifts.high);
  const bool is_one_length = shifts.width() < 0.2 * std::abs(length);
  const bool is_known = std::ranges::any_of(evidence.periods, [&](double p) { return std::abs(std::remainder(length, p)) < 0.1 * p; });
  if (length > 0.0 && is_one_length && (is_known || (values.low + length >= near_values.high && near_values.high < 1.1 * length)))
    found.kind = NoReading::Wrapped, found.low = found.high = length;
  return found;
}

// ---- Jumps ---------------------------------------------------------------------------------------------------------

double logNormal(double z, double mean, double sigma) {
  return -0.5 * std::pow((z - mean) / sigma, 2) - std::log(sigma * std::sqrt(2.0 * std::numbers::pi));
}

struct Mixture {
  double share = 0.1, distance = 4.0, core = 1.0, width = 1.0, likelihood = -INFINITY;
  /// How likely it is that this one jumped.
  [[nodiscard]] double jumped(double z) const {
    const double a = std::log1p(-share) + logNormal(z, 0.0, core), b = std::log(share) + logNormal(std::abs(z), distance, width) - std::numbers::ln2;
    return 1.0 / (1.0 + std::exp(a - b));
  }
};
Mixture fitMixture(const std::vector<double>& z, double start) {
  Mixture m{.distance = start};
  for (int turn = 0; turn < 60; ++turn) {
    double weight = 0.0, sum = 0.0, squares = 0.0, core = 0.0;
    m.likelihood = 0.0;
    for (const double at : z) {
      const double jumped = m.jumped(at), size = std::abs(at);
      weight += jumped, sum += jumped * size, squares += jumped * size * size, core += (1.0 - jumped) * at * at;
      m.likelihood += std::log((1.0 - m.share) * std::exp(logNormal(at, 0.0, m.core)) +
                               0.5 * m.share * std::exp(logNormal(size, m.distance, m.width)) + 1e-300);
    }
    const auto n = static_cast<double>(z.size());
    m.share = std::clamp(weight / n, 1e-4, 0.45);
    m.distance = sum / std::max(1e-9, weight);
    m.core = std::sqrt(core / std::max(1e-9, n - weight));
    m.width = std::max(0.3 * m.core, std::sqrt(std::max(0.0, squares / std::max(1e-9, weight) - m.distance * m.distance)));
  }
  return m;
}
/// Student's t with the freedom and scale that fit best.
double studentLikelihood(const std::vector<double>& z) {
  double best = -INFINITY;
  for (const double freedom : {1.5, 2.0, 3.0, 4.0, 6.0, 10.0, 30.0}) {
    for (double scale = 0.4; scale < 2.5; scale *= 1.12) {
      double sum = 0.0;
      const double constant = std::lgamma(0.5 * (freedom + 1.0)) - std::lgamma(0.5 * freedom) - 0.5 * std::log(freedom * std::numbers::pi) - std::log(scale);
      for (const double at : z) sum += constant - 0.5 * (freedom + 1.0) * std::log1p(std::pow(at / scale, 2) / freedom);
      best = std::max(best, sum);
    }
  }
  return best;
}

/// Rows of about one sigma, in which a core can be told from what jumps.
std::vector<std::vector<Eigen::Index>> strata(const Eigen::VectorXd& sigma) {
  std::vector<Eigen::Index> order;
  for (Eigen::Index i = 0; i < sigma.size(); ++i) order.push_back(i);
  std::ranges::stable_sort(order, {}, [&](Eigen::Index i) { return sigma[i]; });
  std::vector<std::vector<Eigen::Index>> all;
  for (const Eigen::Index i : order) {
    if (all.empty() || sigma[i] > 1.5 * sigma[all.back().front()]) all.emplace_back();
    all.back().push_back(i);
  }
  return all;
}

}  // namespace

std::vector<NoReadings> findNoReadings(const Evidence& evidence, const Eigen::VectorXd& measured) {
  if (evidence.rows() < 20) return {};
  // Beside a line alone: a curve along the reference would take a wrap at its end for its own.
  const Eigen::VectorXd beside_line = besideRobustLine(evidence);
  const std::vector<bool> far_of_line = farRows(beside_line);
  NoReadings first = named(evidence, measured, beside_line, far_of_line);
  if (!first.rows.empty() && first.kind != NoReading::Far) return {std::move(first)};
  const Eigen::VectorXd left = besideFlexible(evidence);
  const std::vector<bool> far = farRows(left);
  if (std::ranges::none_of(far, [](bool f) { return f; })) return {};
  const NoReadings found = named(evidence, measured, left, far);
  const bool is_effect = found.kind == NoReading::Far && std::ranges::any_of(evidence.covariates, [&](const Covariate& c) { return isSaid(far, c); });
  if (is_effect) return {};
  return {found};
}

NoReadings findJumps(const Evidence& evidence, const Eigen::VectorXd& residual) {
  /// The mixture has two numbers more than Student's t, and must be e³ times as likely beyond those.
  constexpr double kClear = 5.0;
  NoReadings found{.kind = NoReading::Jumped};
  for (const auto& rows : strata(evidence.sigma)) {
    if (rows.size() < 40) continue;
    std::vector<double> sizes;
    for (const Eigen::Index i : rows) sizes.push_back(residual[i]);
    const double scale = std::max(1e-300, robustScale(sizes));
    for (double& z : sizes) z /= scale;
    Mixture best;
    for (const double start : {3.0, 4.0, 6.0, 10.0}) {
      const Mixture one = fitMixture(sizes, start);
      if (one.likelihood > best.likelihood) best = one;
    }
    const bool is_apart = best.distance > 3.0 * best.core && best.share * static_cast<double>(rows.size()) >= 5.0;
    if (!is_apart || best.likelihood < studentLikelihood(sizes) + kClear) continue;
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (best.jumped(sizes[i]) > 0.5) found.rows.push_back(rows[i]);
    found.low = found.low == 0.0 ? best.distance * scale : std::min(found.low, best.distance * scale);
    found.high = std::max(found.high, best.distance * scale);
  }
  if (found.rows.empty()) found.kind = NoReading::None;
  std::ranges::sort(found.rows);
  const auto isHigh = [&](Eigen::Index row) { return residual[row] > 0.0; };
  if (!found.rows.empty() && std::ranges::all_of(found.rows, isHigh)) found.side = 1;
  if (!found.rows.empty() && std::ranges::none_of(found.rows, isHigh)) found.side = -1;
  return found;
}

}  // namespace toftwin::loop
