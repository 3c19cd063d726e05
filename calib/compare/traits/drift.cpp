// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>

#include "calib/compare/statistics.h"
#include "calib/compare/traits/decay_grid.h"
#include "calib/compare/traits/least_squares.h"
#include "calib/compare/traits/linearised.h"
#include "calib/compare/traits/odd_rows.h"
#include "calib/compare/traits/uneven.h"

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
  std::vector<double> sigma{};  ///< of each row, whose values are over theirs; empty: all are alike

  [[nodiscard]] Model over(Column t) const {
    return [this, t](Row p, std::size_t i) { return shape(p, t[i]) / (sigma.empty() ? 1.0 : sigma[i]); };
  }
};

Candidate constant() {
  return {DriftModel::Constant, [](Row p, double) { return p[0]; }, {0.0}, 1.0};
}

Candidate ramp() {
  return {DriftModel::Ramp, [](Row p, double t) { return p[0] + p[1] * t; }, {0.0, 0.0}, 2.0};
}

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

/// Sums of the first rows: how much a split of rows explains of their squares is known without visiting them.
class Sums {
 public:
  explicit Sums(Column y) {
    for (const double one : y) sums_.push_back(sums_.back() + one);
  }
  /// Where rows of [from, to) are best split in two of at least kFewest each; `from` where there is no place.
  [[nodiscard]] std::size_t split(std::size_t from, std::size_t to) const {
    std::size_t best = from;
    double most = -1.0;
    for (std::size_t at = from + kFewest; at + kFewest <= to; ++at) {
      if (const double both = explained(from, at) + explained(at, to); both > most) most = both, best = at;
    }
    return best;
  }
  [[nodiscard]] double explained(std::size_t from, std::size_t to) const {
    const double sum = sums_[to] - sums_[from];
    return sum * sum / static_cast<double>(to - from);
  }
  [[nodiscard]] std::size_t rows() const { return sums_.size() - 1; }

 private:
  static constexpr std::size_t kFewest = 3;  // one row that is far off is no step there and back
  std::vector<double> sums_{0.0};
};

/// Two steps: each one's best place beside the other, in turns, from several places.
Candidate twoSteps(Column t, Column y) {
  const Sums sums{y};
  const std::size_t n = sums.rows();
  std::size_t first = 0, second = 0;
  double most = -1.0;
  constexpr std::size_t kStarts = 16, kTurns = 10;
  for (std::size_t start = 0; start < kStarts; ++start) {
    std::size_t a = start * n / kStarts, b = a;
    for (std::size_t turn = 0; turn < kTurns; ++turn) {
      const auto before = std::pair{a, b};
      b = sums.split(a, n);
      a = sums.split(0, b);
      if (before == std::pair{a, b}) break;
    }
    if (a == 0 || b <= a) continue;
    const double both = sums.explained(0, a) + sums.explained(a, b) + sums.explained(b, n);
    if (both > most) most = both, first = a, second = b;
  }
  if (first == 0) return {.kind = DriftModel::TwoSteps};
  const double at_1 = 0.5 * (t[first - 1] + t[first]), at_2 = 0.5 * (t[second - 1] + t[second]);
  return {DriftModel::TwoSteps,
          [=](Row p, double time) {
            return p[0] + (time > at_1 ? p[1] : 0.0) + (time > at_2 ? p[2] : 0.0);
          },
          {0.0, 0.0, 0.0},
          7.0};
}

std::optional<Fit> fitOf(const Candidate& candidate, Column t, Column y) {
  if (!candidate.shape) return std::nullopt;
  return fitLeastSquares(candidate.over(t), y, candidate.start);
}

/// Exponentials that are over before the second row or outlast the series twenty times are none.
bool isPlausible(const Candidate& candidate, const Fit& fit, Column t) {
  if (candidate.kind != DriftModel::OneExponential && candidate.kind != DriftModel::TwoExponentials)
    return true;
  for (std::size_t k = 2; k < fit.at.size(); k += 2) {
    const double tau = std::exp(fit.at[k]);
    if (!(tau > shortestDecay(t)) || !(tau < kLongestDecay)) return false;
  }
  return true;
}

/// Errors that go on look like structure: what they are is taken from the richest models that fit, exponentials
/// and steps, of that which leaves less of it. What steps leave beside exponentials goes on, and the other way
/// round.
double goingOn(std::span<const Candidate> candidates, Column t, Column y) {
  const auto leftBy = [&](std::initializer_list<DriftModel> from_the_richest) -> std::optional<double> {
    for (const DriftModel kind : from_the_richest) {
      const Candidate& rich = *std::ranges::find(candidates, kind, &Candidate::kind);
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

constexpr std::size_t kModels = 6;
using Candidates = std::array<Candidate, kModels>;

/// A model that was fitted, one that was not chosen, too.
struct Tried {
  const Candidate* model = nullptr;
  Fit fit{};
  double bic = 0.0;
};

/// The series, and which model it follows.
struct Chosen {
  std::vector<double> y{};  ///< over each row's σ
  const Candidate* model = nullptr;
  Fit fit{};
  double rho = 0.0;  ///< by which errors go on
  std::vector<Tried> all{};
};

/// The least BIC.
std::optional<Chosen> chosenOf(const Candidates& candidates, Column t, std::vector<double> y) {
  const double n = static_cast<double>(y.size()), rho = goingOn(candidates, t, y);
  const double effective = n * (1.0 - rho) / (1.0 + rho);
  double least = std::numeric_limits<double>::infinity();
  Chosen best{.rho = rho};
  for (const Candidate& candidate : candidates) {
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
std::optional<Chosen> chosenBySigma(Candidates& candidates, Column t, Column y) {
  auto best = chosenOf(candidates, t, {y.begin(), y.end()});
  constexpr int kRounds = 3;
  for (int round = 0; best && round < kRounds; ++round) {
    const Shape& shape = best->model->shape;
    const Model plain = [&](Row p, std::size_t i) { return shape(p, t[i]); };
    const auto sigmas = unevenSigmas(leftBy(plain, best->fit, y), t, best->fit.at.size());
    if (sigmas.empty()) break;
    for (Candidate& one : candidates) one.sigma = sigmas;
    if (auto next = chosenOf(candidates, t, over(y, sigmas)))
      best = std::move(next);
    else
      break;
  }
  if (best && !best->model->sigma.empty()) tellErrorsByRows(best->fit, best->model->over(t), best->y);
  return best;
}

/// What changed between the first and the last row.
Trait changeOf(const Shape& shape, const Fit& fit, Column t) {
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
  const DecayGrid grid{t, y};
  Candidates candidates{constant(), ramp(), oneExponential(grid), twoExponentials(grid), step(t, y),
                              twoSteps(t, y)};
  auto chosen = chosenBySigma(candidates, t, y);
  if (!chosen) return undetermined(kName, "no model can be fitted");
  const Candidate* model = chosen->model;
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
  const Shape& shape = model->shape;
  result.traits.push_back(changeOf(shape, fit, t));
  heedOtherModels(*chosen, t, result.traits.back());
  result.traits.back().refers_to = OverSpan{length};
  addDetails(result.model, fit, t, length, result.traits);
  if (is_another) {
    const Model plain = [&](Row p, std::size_t i) { return shape(p, t[i]); };
    doubtShape(betweenEnds(y, chosen->rho), betweenEnds(leftBy(plain, fit, y), chosen->rho), result.traits);
  }
  const OddRows odd = oddRowsOf([&](Row p, std::size_t i) { return shape(p, t[i]); }, y, fit.at, t);
  for (Trait& one : result.traits)
    if (!odd.doubt.empty()) one.doubt = odd.doubt, one.odd_rows = odd.rows;
  return result;
}

}  // namespace toftwin::compare
