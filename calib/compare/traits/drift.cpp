// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/decay_grid.h"
#include "calib/compare/traits/drift_models.h"
#include "calib/compare/traits/drift_odd_rows.h"
#include "calib/compare/traits/least_squares.h"
#include "calib/compare/traits/linearised.h"
#include "calib/compare/traits/odd_rows.h"
#include "calib/compare/traits/uneven.h"

namespace toftwin::compare {
namespace {

constexpr const char* kName = "drift";

/// Errors that go on look like structure: what they are is taken from the richest models that fit, exponentials
/// and steps, of that which leaves less of it. What steps leave beside exponentials goes on, and the other way
/// round.
double goingOn(std::span<const DriftCandidate> candidates, Column t, Column y) {
  const auto leftBy = [&](std::initializer_list<DriftModel> from_the_richest) -> std::optional<double> {
    for (const DriftModel kind : from_the_richest) {
      const DriftCandidate& rich = *std::ranges::find(candidates, kind, &DriftCandidate::kind);
      if (const auto fit = fitOf(rich, t, y)) return correlationOfResiduals(rich.over(t), y, *fit);
    }
    return std::nullopt;
  };
  const auto by_curves = leftBy({DriftModel::TwoExponentials, DriftModel::OneExponential, DriftModel::Ramp}),
             by_steps = leftBy({DriftModel::TwoSteps, DriftModel::Step});
  return std::min(by_curves.value_or(0.0), by_steps.value_or(by_curves.value_or(0.0)));
}

void addDetails(DriftModel kind, const Fit& fit, Column t, double length_s, std::vector<Trait>& traits) {
  const auto tau = [&](const char* name, std::size_t k) {
    // ln τ is what is nearly normal; its interval is taken there. An end that no rows of these could show is
    // not known.
    Trait trait = fit.trait(name, "s", k);
    if (trait.low < std::log(shortestDecay(t))) trait.low = std::nan("");
    if (trait.high > std::log(kLongestDecay)) trait.high = std::nan("");
    for (double* value : {&trait.value, &trait.low, &trait.high}) *value = length_s * std::exp(*value);
    traits.push_back(std::move(trait));
  };
  if (kind == DriftModel::Ramp) traits.push_back(fit.trait("slope", "mm/s", 1, 1.0 / length_s));
  if (kind == DriftModel::Step) traits.push_back(fit.trait("step", "mm", 1));
  if (kind == DriftModel::TwoSteps)
    traits.insert(traits.end(), {fit.trait("first step", "mm", 1), fit.trait("second step", "mm", 2)});
  if (kind == DriftModel::OneExponential) tau("time constant", 2);
  if (kind != DriftModel::TwoExponentials) return;
  const bool is_ordered = fit.at[2] < fit.at[4];
  tau("fast time constant", is_ordered ? 2 : 4);
  tau("slow time constant", is_ordered ? 4 : 2);
}

/// What a model leaves, row by row.
std::vector<double> leftBy(const Model& model, const Fit& fit, Column y) {
  std::vector<double> left;
  for (std::size_t i = 0; i < y.size(); ++i) left.push_back(y[i] - model(fit.at, i));
  return left;
}

/// A model that was fitted, one that was not chosen, too.
struct Tried {
  const DriftCandidate* model = nullptr;
  Fit fit{};
  double bic = 0.0;
};

/// The series, and which model it follows.
struct Chosen {
  std::vector<double> y{};  ///< over each row's σ
  const DriftCandidate* model = nullptr;
  Fit fit{};
  double rho = 0.0;  ///< by which errors go on
  std::vector<Tried> all{};
};

/// The least BIC.
std::optional<Chosen> chosenOf(const DriftCandidates& candidates, Column t, std::vector<double> y) {
  const double n = static_cast<double>(y.size()), rho = goingOn(candidates, t, y);
  const double effective = n * (1.0 - rho) / (1.0 + rho);
  double least = std::numeric_limits<double>::infinity();
  Chosen best{.rho = rho};
  for (const DriftCandidate& candidate : candidates) {
    auto tried = fitOf(candidate, t, y);
    if (!tried) continue;
    const double bic =
        effective * std::log(std::max(tried->squares, 1e-18 * n) / n) + candidate.cost * std::log(effective);
    if (isPlausible(candidate, *tried, t) && bic < least) {
      least = bic;
      best.model = &candidate;
      best.fit = *tried;
    }
    best.all.push_back({&candidate, std::move(*tried), bic});
  }
  if (best.model == nullptr) return std::nullopt;
  best.y = std::move(y);
  return best;
}

/// With the rows' σ where what is left over time is uneven, as of a camera that is noisier while it is cold.
std::optional<Chosen> chosenBySigma(DriftCandidates& candidates, Column t, Column y) {
  auto best = chosenOf(candidates, t, {y.begin(), y.end()});
  constexpr int kRounds = 3;
  for (int round = 0; best && round < kRounds; ++round) {
    const DriftShape& shape = best->model->shape;
    const Model plain = [&](std::span<const double> p, std::size_t i) { return shape(p, t[i]); };
    const auto sigmas = unevenSigmas(leftBy(plain, best->fit, y), t, best->fit.at.size());
    if (sigmas.empty()) break;
    for (DriftCandidate& one : candidates) one.sigma = sigmas;
    if (auto next = chosenOf(candidates, t, over(y, sigmas)))
      best = std::move(next);
    else
      break;
  }
  if (best && !best->model->sigma.empty()) tellErrorsByRows(best->fit, best->model->over(t), best->y);
  return best;
}

/// What changed between the first and the last row.
Trait changeOf(const DriftShape& shape, const Fit& fit, Column t) {
  return fit.trait("drift", "mm",
                   [&](std::span<const double> p) { return shape(p, t.back()) - shape(p, t.front()); });
}

/// Few rows do not tell which model they follow, and each has another change over them. The interval is what holds
/// Student's numbers of all models together with 95 %, each weighted by e^(−BIC/2) (A. E. Raftery, Sociol. Methodol. 25
/// (1995) 111). That nothing changed is never exactly known: the constant counts as a ramp.
void heedOtherModels(const Chosen& chosen, Column t, Trait& change) {
  struct Told {
    double weight = 0.0, value = 0.0, error = 0.0, degrees = 0.0;
  };
  double least = std::numeric_limits<double>::infinity(), of_constant = 0.0;
  for (const Tried& one : chosen.all) least = std::min(least, one.bic);
  std::vector<Told> all;
  for (const Tried& one : chosen.all) {
    const double weight = std::exp(-0.5 * (one.bic - least));
    if (one.model->kind == DriftModel::Constant) of_constant = weight;
    constexpr double kLittle = 1e-4;
    if (one.model->kind == DriftModel::Constant || weight < kLittle) continue;
    Fit fit = one.fit;
    if (!one.model->sigma.empty()) tellErrorsByRows(fit, one.model->over(t), chosen.y);
    fit.heedCorrelation(correlationOfResiduals(one.model->over(t), chosen.y, fit));
    const Trait told = changeOf(one.model->shape, fit, t);
    const double error = (told.high - told.value) / studentT(told.degrees);
    if (std::isfinite(error) && error > 0.0) all.push_back({weight, told.value, error, told.degrees});
    if (one.model->kind == DriftModel::Ramp && !all.empty()) all.back().weight += of_constant;
  }
  if (all.empty()) return;
  const auto below = [&](double at) {
    double held = 0.0, sum = 0.0;
    for (const Told& one : all) {
      const boost::math::students_t student{one.degrees};
      held += one.weight * boost::math::cdf(student, (at - one.value) / one.error);
      sum += one.weight;
    }
    return held / sum;
  };
  double from = change.low, to = change.high;
  for (const Told& one : all) {
    from = std::min(from, one.value - studentT(one.degrees) * one.error);
    to = std::max(to, one.value + studentT(one.degrees) * one.error);
  }
  const auto quantile = [&](double share) {
    double low = from, high = to;
    constexpr int kHalvings = 40;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (low + high);
      (below(middle) < share ? low : high) = middle;
    }
    return high;
  };
  change.low = std::min(change.value, quantile(0.025));
  change.high = std::max(change.value, quantile(0.975));
}

constexpr std::size_t kTenths = 10;
std::size_t rowsOfBlock(Column rows) { return std::max<std::size_t>(1, rows.size() / kTenths); }

/// Whether the means of ten blocks of what a curve of so many parameters leaves are more than chance makes of rows
/// that go with the next by `rho`: χ², wrong once in a thousand series of that shape.
bool isOfAnotherShape(const std::vector<double>& left, std::size_t parameters, double rho) {
  constexpr double kWrong = 1e-3;
  constexpr std::size_t kFewestOfBlock = 3;
  if (parameters >= kTenths || left.size() < kFewestOfBlock * kTenths) return false;
  const double variance = summarise(left).sd * summarise(left).sd * (1.0 + rho) / (1.0 - rho);
  double squares = 0.0;
  for (std::size_t block = 0; block < kTenths; ++block) {
    const std::size_t from = block * left.size() / kTenths, to = (block + 1) * left.size() / kTenths;
    const double mean = summarise(Column{left}.subspan(from, to - from)).mean;
    squares += mean * mean * static_cast<double>(to - from) / variance;
  }
  const boost::math::chi_squared chance{static_cast<double>(kTenths - parameters)};
  return squares > boost::math::quantile(boost::math::complement(chance, kWrong));
}

/// The last tenth less the first.
Trait betweenEnds(Column rows, double rho) {
  const std::size_t tenth = rowsOfBlock(rows);
  const Summary first = summarise(rows.first(tenth)), last = summarise(rows.last(tenth));
  const double error = std::hypot(first.standard_error, last.standard_error) * std::sqrt((1.0 + rho) / (1.0 - rho));
  const double by = last.mean - first.mean, half = studentT(static_cast<double>(tenth - 1)) * error;
  return {.value = by, .low = by - half, .high = by + half};
}

/// Numbers of a curve that the series is not: they are the best such curve's, which no interval of them says. A drift
/// is as uncertain as to hold what the ends themselves say, as they are and as they are beside the curve.
void doubtShape(const Trait& ends, const Trait& left_at_ends, std::vector<Trait>& traits) {
  Trait& drift = traits.front();
  drift.low = std::min({drift.low, ends.low, drift.value + left_at_ends.low});
  drift.high = std::max({drift.high, ends.high, drift.value + left_at_ends.high});
  for (Trait& one : traits) one.doubt = "the series is of another shape than the curve that it is told from";
}

/// Where what is left of the chosen curve goes on from row to row, the series may be of a shape that is not
/// in the list: then the curve's numbers are those of the best such curve. What any shape has is said beside
/// it.
std::string whatGoesOn(double rho, bool is_of_another_shape, Column value_mm) {
  constexpr double kMuch = 0.6;
  if (!(rho > kMuch) && !is_of_another_shape) return {};
  const std::size_t tenth = rowsOfBlock(value_mm);
  const double first = summarise(value_mm.first(tenth)).mean, last = summarise(value_mm.last(tenth)).mean;
  const std::string what =
      is_of_another_shape
          ? "tenths of the series are off the chosen curve by more than chance: its drift has another shape than any "
            "of the list"
          : fmt::format("what is left of the chosen curve goes on from row to row (correlation {:.2f}): the camera "
                        "errs so, or its drift has another shape than any of the list",
                        rho);
  return fmt::format(
      "{}, and the numbers say nothing of it. As measured, the last tenth of the rows is {:.3g} mm from the first on "
      "the mean",
      what, last - first);
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
    case DriftModel::TwoSteps:
      return "two steps";
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
  DriftCandidates candidates = driftCandidates(t, y);
  auto chosen = chosenBySigma(candidates, t, y);
  if (!chosen) return undetermined(kName, "no model can be fitted");
  const DriftCandidate* model = chosen->model;
  Fit& fit = chosen->fit;
  DriftTraits result{.model = model->kind};
  result.curve = {nameOf(model->kind), [=, shape = model->shape, p = fit.at](double at_s) {
                    return first + shape(p, (at_s - begin) / length);
                  }};
  const bool is_another = isOfAnotherShape(leftBy(model->over(t), fit, chosen->y), fit.at.size(), chosen->rho);
  result.not_told = whatGoesOn(correlationOfResiduals(model->over(t), chosen->y, fit), is_another, y);
  // Where no drift can be told, "drift" is what a ramp could still be: not known to be exactly nothing.
  if (model->kind == DriftModel::Constant) {
    model = &candidates[1];
    if (auto hidden = fitOf(*model, t, chosen->y))
      fit = std::move(*hidden);
    else
      return undetermined(kName, "no ramp can be fitted");
  }
  fit.heedCorrelation(correlationOfResiduals(model->over(t), chosen->y, fit));
  const DriftShape& shape = model->shape;
  result.traits.push_back(changeOf(shape, fit, t));
  heedOtherModels(*chosen, t, result.traits.back());
  result.traits.back().refers_to = OverSpan{length};
  addDetails(result.model, fit, t, length, result.traits);
  if (is_another) {
    const Model plain = [&](std::span<const double> p, std::size_t i) { return shape(p, t[i]); };
    doubtShape(betweenEnds(y, chosen->rho), betweenEnds(leftBy(plain, fit, y), chosen->rho), result.traits);
  }
  const OddRows odd = oddRowsOfSeries(model->kind, fit, t, y);
  for (Trait& one : result.traits)
    if (!odd.doubt.empty()) one.doubt = odd.doubt, one.odd_rows = odd.rows;
  return result;
}

}  // namespace toftwin::compare
