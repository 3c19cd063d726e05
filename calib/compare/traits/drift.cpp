// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

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
  std::vector<std::vector<double>> starts{};
  double cost = 0.0;  ///< parameters, as BIC counts them

  [[nodiscard]] Model over(Column t) const {
    return [shape = shape, t](Row p, std::size_t i) { return shape(p, t[i]); };
  }
};

Candidate constant() {
  return {DriftModel::Constant, [](Row p, double) { return p[0]; }, {{0.0}}, 1.0};
}

Candidate ramp() {
  return {DriftModel::Ramp, [](Row p, double t) { return p[0] + p[1] * t; }, {{0.0, 0.0}}, 2.0};
}

double decay(double t, double log_tau) { return std::exp(-t / std::exp(log_tau)); }

Candidate oneExponential() {
  Candidate one{
      DriftModel::OneExponential, [](Row p, double t) { return p[0] + p[1] * decay(t, p[2]); }, {}, 3.0};
  for (const double tau : {0.03, 0.1, 0.3, 1.0}) one.starts.push_back({0.0, 1.0, std::log(tau)});
  return one;
}

Candidate twoExponentials() {
  Candidate two{DriftModel::TwoExponentials,
                [](Row p, double t) { return p[0] + p[1] * decay(t, p[2]) + p[3] * decay(t, p[4]); },
                {},
                5.0};
  for (const auto& [fast, slow] : {std::pair{0.03, 0.3}, {0.1, 0.5}, {0.05, 1.0}})
    two.starts.push_back({0.0, 1.0, std::log(fast), 0.5, std::log(slow)});
  return two;
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
          {{0.0, 0.0}},
          4.0};
}

std::optional<Fit> bestFit(const Candidate& candidate, Column t, Column y) {
  std::optional<Fit> best;
  const Model model = candidate.over(t);
  for (const auto& start : candidate.starts) {
    auto fit = fitLeastSquares(model, y, start);
    if (fit && (!best || fit->squares < best->squares)) best = std::move(fit);
  }
  return best;
}

/// Exponentials that are over before the second row or outlast the series twenty times are none.
bool isPlausible(const Candidate& candidate, const Fit& fit, Column t) {
  if (candidate.kind != DriftModel::OneExponential && candidate.kind != DriftModel::TwoExponentials)
    return true;
  for (std::size_t k = 2; k < fit.at.size(); k += 2) {
    const double tau = std::exp(fit.at[k]);
    if (!(tau > t[1] - t[0]) || !(tau < 20.0)) return false;
  }
  return true;
}

void addDetails(DriftModel kind, const Fit& fit, double length_s, std::vector<Trait>& traits) {
  const auto tau = [&](const char* name, std::size_t k) {
    // ln τ is what is nearly normal; its interval is taken there.
    Trait trait = fit.trait(name, "s", k);
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
  const std::array candidates{constant(), ramp(), oneExponential(), twoExponentials(), step(t, y)};
  double least = std::numeric_limits<double>::infinity(), rho = 0.0;
  // Errors that go on look like structure: what they are is taken from the richest model, which leaves the
  // least of it.
  if (const auto rich = bestFit(candidates[3], t, y))
    rho = correlationOfResiduals(candidates[3].over(t), y, *rich);
  const double effective = n * (1.0 - rho) / (1.0 + rho);
  const Candidate* chosen = nullptr;
  std::optional<Fit> fit;
  for (const Candidate& candidate : candidates) {
    auto tried = bestFit(candidate, t, y);
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
  // Where no drift can be told, "drift" is what a ramp could still be: not known to be exactly nothing.
  if (chosen->kind == DriftModel::Constant) {
    chosen = &candidates[1];
    if (auto hidden = bestFit(*chosen, t, y))
      fit = std::move(hidden);
    else
      return undetermined(kName, "no ramp can be fitted");
  }
  fit->heedCorrelation(correlationOfResiduals(chosen->over(t), y, *fit));
  result.traits.push_back(fit->trait("drift", "mm", [&](std::span<const double> p) {
    return chosen->shape(p, t.back()) - chosen->shape(p, t.front());
  }));
  addDetails(result.model, *fit, length, result.traits);
  return result;
}

}  // namespace toftwin::compare
