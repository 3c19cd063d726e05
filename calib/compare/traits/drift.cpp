// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {
namespace {

constexpr const char* kName = "drift";

using Row = std::span<const double>;
/// What a model with parameters p says at a time.
using Shape = std::function<double(Row p, double t)>;

/// A model of the series, ready to be fitted. Times are relative to the series' length, so that numbers are
/// of order 1.
struct Candidate {
  DriftModel kind = DriftModel::Constant;
  Shape shape{};
  std::vector<double> start{};
  double cost = 0.0;  ///< parameters, as BIC counts them

  [[nodiscard]] Model over(Column t) const {
    return [shape = shape, t](Row p, std::size_t i) { return shape(p, t[i]); };
  }
};

Candidate constant() {
  return {DriftModel::Constant, [](Row p, double) { return p[0]; }, {0.0}, 1.0};
}

Candidate ramp() {
  return {DriftModel::Ramp, [](Row p, double t) { return p[0] + p[1] * t; }, {0.0, 0.0}, 2.0};
}

double decay(double t, double log_tau) { return std::exp(-t / std::exp(log_tau)); }

/// Time constants that rows can show: from the first two rows' interval to twenty times the series.
constexpr double kLongest = 20.0;
double shortest(Column t) { return t[1] - t[0]; }

/// Where a fit of exponentials begins: for each time constant of a logarithmic grid (or each pair) amplitudes
/// are a linear problem, of which the best is taken. From a start far from it Gauss and Newton's steps may
/// end in another valley, or on a plateau where a time constant runs away.
class DecayGrid {
 public:
  DecayGrid(Column t, Column y) {
    constexpr double kRatio = 1.25;
    for (double tau = std::max(shortest(t), 1e-4); tau < kLongest; tau *= kRatio)
      log_taus_.push_back(std::log(tau));
    Eigen::MatrixXd basis(static_cast<Eigen::Index>(t.size()), size() + 1);
    for (Eigen::Index i = 0; i < basis.rows(); ++i) {
      basis(i, 0) = 1.0;
      for (Eigen::Index k = 0; k < size(); ++k)
        basis(i, k + 1) = decay(t[static_cast<std::size_t>(i)], log_taus_[static_cast<std::size_t>(k)]);
    }
    products_ = basis.transpose() * basis;
    with_y_ = basis.transpose() * Eigen::Map<const Eigen::VectorXd>(y.data(), basis.rows());
  }

  [[nodiscard]] std::vector<double> one() const {
    std::vector<double> best{0.0, 0.0, 0.0};
    double most = -1.0;
    for (int k = 1; k <= size(); ++k) keepBetter(std::array{0, k}, most, best);
    return best;
  }
  [[nodiscard]] std::vector<double> two() const {
    std::vector<double> best{0.0, 0.0, 0.0, 0.0, 0.0};
    double most = -1.0;
    for (int k = 1; k <= size(); ++k) {
      for (int l = k + 1; l <= size(); ++l) keepBetter(std::array{0, k, l}, most, best);
    }
    return best;
  }

 private:
  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(log_taus_.size()); }

  /// What amplitudes x of some columns explain, xᵀ(Bᵀy), if it is more than `most`.
  template <std::size_t N>
  void keepBetter(const std::array<int, N>& columns, double& most, std::vector<double>& best) const {
    constexpr int kSize = static_cast<int>(N);
    const Eigen::Matrix<double, kSize, kSize> normal = products_(columns, columns);
    const Eigen::Matrix<double, kSize, 1> right = with_y_(columns);
    const Eigen::Matrix<double, kSize, 1> x = normal.ldlt().solve(right);
    if (const double explained = x.dot(right); x.allFinite() && explained > most) {
      most = explained;
      best = {x[0]};
      for (std::size_t k = 1; k < N; ++k)
        best.insert(best.end(),
                    {x[static_cast<int>(k)], log_taus_[static_cast<std::size_t>(columns[k] - 1)]});
    }
  }

  std::vector<double> log_taus_{};
  Eigen::MatrixXd products_{};
  Eigen::VectorXd with_y_{};
};

Candidate oneExponential(const DecayGrid& grid) {
  return {DriftModel::OneExponential, [](Row p, double t) { return p[0] + p[1] * decay(t, p[2]); },
          grid.one(), 3.0};
}

Candidate twoExponentials(const DecayGrid& grid) {
  return {DriftModel::TwoExponentials,
          [](Row p, double t) { return p[0] + p[1] * decay(t, p[2]) + p[3] * decay(t, p[4]); }, grid.two(),
          5.0};
}

/// The step between two rows where it leaves the least; its place is searched, not fitted.
Candidate step(Column t, Column y) {
  double total = 0.0;
  for (const double value : y) total += value;
  const double n = static_cast<double>(y.size());
  double before = 0.0, best = -1.0;
  std::size_t at = 1;
  for (std::size_t i = 1; i < y.size(); ++i) {
    before += y[i - 1];
    const double m = static_cast<double>(i), difference = (total - before) / (n - m) - before / m;
    if (const double between = difference * difference * m * (n - m); between > best) {
      best = between;
      at = i;
    }
  }
  const double place = 0.5 * (t[at - 1] + t[at]);
  return {DriftModel::Step,
          [place](Row p, double time) { return p[0] + (time > place ? p[1] : 0.0); },
          {0.0, 0.0},
          4.0};
}

std::optional<Fit> fitOf(const Candidate& candidate, Column t, Column y) {
  return fitLeastSquares(candidate.over(t), y, candidate.start);
}

/// Exponentials that are over before the second row or outlast the series twenty times are none.
bool isPlausible(const Candidate& candidate, const Fit& fit, Column t) {
  if (candidate.kind != DriftModel::OneExponential && candidate.kind != DriftModel::TwoExponentials)
    return true;
  for (std::size_t k = 2; k < fit.at.size(); k += 2) {
    const double tau = std::exp(fit.at[k]);
    if (!(tau > shortest(t)) || !(tau < kLongest)) return false;
  }
  return true;
}

void addDetails(DriftModel kind, const Fit& fit, Column t, double length_s, std::vector<Trait>& traits) {
  const auto tau = [&](const char* name, std::size_t k) {
    // ln τ is what is nearly normal; its interval is taken there. An end that no rows of these could show is
    // not known.
    Trait trait = fit.trait(name, "s", k);
    if (trait.low < std::log(shortest(t))) trait.low = std::nan("");
    if (trait.high > std::log(kLongest)) trait.high = std::nan("");
    for (double* value : {&trait.value, &trait.low, &trait.high}) *value = length_s * std::exp(*value);
    traits.push_back(std::move(trait));
  };
  if (kind == DriftModel::Ramp) traits.push_back(fit.trait("slope", "mm/s", 1, 1.0 / length_s));
  if (kind == DriftModel::Step) traits.push_back(fit.trait("step", "mm", 1));
  if (kind == DriftModel::OneExponential) tau("time constant", 2);
  if (kind != DriftModel::TwoExponentials) return;
  const bool is_ordered = fit.at[2] < fit.at[4];
  tau("fast time constant", is_ordered ? 2 : 4);
  tau("slow time constant", is_ordered ? 4 : 2);
}

/// Where what is left of the chosen curve goes on from row to row, the series may be of a shape that is not
/// in the list: then the curve's numbers are those of the best such curve. What any shape has is said beside
/// it.
std::string whatGoesOn(double rho, Column value_mm) {
  constexpr double kMuch = 0.6;
  if (!(rho > kMuch)) return {};
  const std::size_t tenth = std::max<std::size_t>(1, value_mm.size() / 10);
  const double first = summarise(value_mm.first(tenth)).mean, last = summarise(value_mm.last(tenth)).mean;
  return fmt::format(
      "what is left of the chosen curve goes on from row to row (correlation {:.2f}): the camera errs so, or "
      "its drift "
      "has another shape than any of the list, and the numbers say nothing of it. As measured, the last "
      "tenth of the rows is "
      "{:.3g} mm from the first on the mean",
      rho, last - first);
}

}  // namespace

const char* nameOf(DriftModel model) {
  switch (model) {
    case DriftModel::Constant:
      return "none";
    case DriftModel::Ramp:
      return "ramp";
    case DriftModel::OneExponential:
      return "one exponential";
    case DriftModel::TwoExponentials:
      return "two exponentials";
    case DriftModel::Step:
      return "step";
  }
  return "";
}

Result<DriftTraits> driftTraits(Column time_s, Column value_mm) {
  auto rows = finiteRows({time_s, value_mm}, 12, kName);
  if (!rows) return rows.error();
  auto &t = (*rows)[0], &y = (*rows)[1];
  if (!std::ranges::is_sorted(t) || !(t.back() > t.front())) return undetermined(kName, "times must ascend");
  const double begin = t.front(), length = t.back() - begin, first = y.front();
  for (double& one : t) one = (one - begin) / length;
  for (double& one : y) one -= first;
  const double n = static_cast<double>(y.size());
  const DecayGrid grid{t, y};
  const std::array candidates{constant(), ramp(), oneExponential(grid), twoExponentials(grid), step(t, y)};
  double least = std::numeric_limits<double>::infinity(), rho = 0.0;
  // Errors that go on look like structure: what they are is taken from the richest model that fits, which
  // leaves the least of it.
  for (const std::size_t richest : {3, 2, 1}) {
    const auto rich = fitOf(candidates[richest], t, y);
    if (!rich) continue;
    rho = correlationOfResiduals(candidates[richest].over(t), y, *rich);
    break;
  }
  const double effective = n * (1.0 - rho) / (1.0 + rho);
  const Candidate* chosen = nullptr;
  std::optional<Fit> fit;
  for (const Candidate& candidate : candidates) {
    auto tried = fitOf(candidate, t, y);
    if (!tried || !isPlausible(candidate, *tried, t)) continue;
    const double bic =
        effective * std::log(std::max(tried->squares, 1e-18 * n) / n) + candidate.cost * std::log(effective);
    if (bic >= least) continue;
    least = bic;
    chosen = &candidate;
    fit = std::move(tried);
  }
  if (!fit) return undetermined(kName, "no model can be fitted");
  DriftTraits result{.model = chosen->kind};
  result.curve = {nameOf(chosen->kind), [=, shape = chosen->shape, p = fit->at](double at_s) {
                    return first + shape(p, (at_s - begin) / length);
                  }};
  result.not_told = whatGoesOn(correlationOfResiduals(chosen->over(t), y, *fit), y);
  // Where no drift can be told, "drift" is what a ramp could still be: not known to be exactly nothing.
  if (chosen->kind == DriftModel::Constant) {
    chosen = &candidates[1];
    if (auto hidden = fitOf(*chosen, t, y))
      fit = std::move(hidden);
    else
      return undetermined(kName, "no ramp can be fitted");
  }
  fit->heedCorrelation(correlationOfResiduals(chosen->over(t), y, *fit));
  result.traits.push_back(fit->trait("drift", "mm", [&](std::span<const double> p) {
    return chosen->shape(p, t.back()) - chosen->shape(p, t.front());
  }));
  result.traits.back().refers_to = OverSpan{length};
  addDetails(result.model, *fit, t, length, result.traits);
  return result;
}

}  // namespace toftwin::compare
