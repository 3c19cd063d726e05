// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/curve.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "calib/discover/table_source.h"

namespace toftwin::discover {
namespace {

double termAt(const Term& term, const std::map<std::string, double>& at) {
  const double value = term.at([&](const std::string& name) {
    const auto found = at.find(name);
    return found == at.end() ? 0.0 : found->second;
  });
  return std::isfinite(value) ? value : 0.0;
}

double partAt(const FittedForm& part, const double* coefficient, std::span<const double> inner,
              const std::map<std::string, double>& at) {
  const TermGroup group = part.form.build == nullptr ? part.group : built(part.form, inner);
  double sum = 0.0;
  for (std::size_t t = 0; t < group.terms.size(); ++t) sum += coefficient[t] * termAt(group.terms[t], at);
  return sum;
}

/// How far an inner number is moved for a slope.
double slightly(double inner) { return 1e-4 * (std::abs(inner) + 1e-12); }

Eigen::VectorXd meansOf(const TableData& rows, std::span<const Term> terms) {
  return columnsOf(rows, terms).colwise().mean();
}

}  // namespace

Level levelOf(const Effect& effect, const TableData& rows) {
  Level level;
  level.slope = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(effect.numbers.size()));
  Eigen::Index term = 0, inner = static_cast<Eigen::Index>(effect.coefficient.size());
  for (const FittedForm& part : effect.parts) {
    const auto terms = static_cast<Eigen::Index>(part.group.terms.size());
    const auto own = Eigen::Map<const Eigen::VectorXd>(effect.coefficient.data() + term, terms);
    const Eigen::VectorXd mean = meansOf(rows, part.group.terms);
    level.slope.segment(term, terms) = mean;
    level.value += own.dot(mean);
    for (std::size_t i = 0; i < part.inner.size(); ++i) {
      std::vector<double> moved = part.inner;
      moved[i] += slightly(moved[i]);
      const Eigen::VectorXd there = meansOf(rows, built(part.form, moved).terms);
      level.slope(inner++) = own.dot(there - mean) / slightly(part.inner[i]);
    }
    term += terms;
  }
  return level;
}

std::vector<double> effectIn(const TableData& rows, const Effect& effect) {
  const Eigen::MatrixXd columns = columnsOf(rows, termsOf(effect));
  const auto own = Eigen::Map<const Eigen::VectorXd>(effect.coefficient.data(), columns.cols());
  const Eigen::VectorXd values = columns * own;
  return {values.begin(), values.end()};
}

std::pair<double, double> rowsAround(const TableData& rows, const std::string& covariate, double place) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  std::pair around{-kNone, kNone};
  const auto at = std::ranges::find(rows.covariates, covariate, &TableCovariate::name);
  if (at == rows.covariates.end()) return {place, place};
  for (const double x : at->values) {
    if (x < place) around.first = std::max(around.first, x);
    if (x >= place) around.second = std::min(around.second, x);
  }
  return {std::isfinite(around.first) ? around.first : place,
          std::isfinite(around.second) ? around.second : place};
}

std::optional<StepRows> stepRows(const TableData& rows, const Effect& effect, std::size_t number) {
  std::size_t next = effect.coefficient.size();
  for (const FittedForm& part : effect.parts) {
    const bool is_step = !part.group.terms.empty() && !part.group.terms[0].factors.empty() &&
                         part.group.terms[0].factors[0].shape == Shape::Step;
    for (std::size_t i = 0; i < part.inner.size(); ++i, ++next) {
      if (next != number || !is_step) continue;
      const std::string& covariate = part.form.covariates[0];
      const auto [below, from] = rowsAround(rows, covariate, part.inner[i]);
      return StepRows{covariate, below, from};
    }
  }
  return std::nullopt;
}

Point effectAt(const Effect& effect, const std::map<std::string, double>& at, const Level& level) {
  Point point;
  const auto numbers = static_cast<Eigen::Index>(effect.numbers.size());
  Eigen::VectorXd slope = Eigen::VectorXd::Zero(numbers);
  Eigen::Index term = 0, inner = static_cast<Eigen::Index>(effect.coefficient.size());
  for (const FittedForm& part : effect.parts) {
    const double* coefficient = effect.coefficient.data() + term;
    const double here = partAt(part, coefficient, part.inner, at);
    point.value += here;
    for (const Term& one : part.group.terms)
      if (term < numbers) slope(term++) = termAt(one, at);
    for (std::size_t i = 0; i < part.inner.size(); ++i) {
      std::vector<double> moved = part.inner;
      const double step = slightly(moved[i]);
      moved[i] += step;
      if (inner < numbers) slope(inner++) = (partAt(part, coefficient, moved, at) - here) / step;
    }
  }
  point.value -= level.value;
  if (level.slope.size() == numbers) slope -= level.slope;
  if (effect.covariance.rows() == numbers)
    point.error = std::sqrt(std::max(0.0, slope.dot(effect.covariance * slope)));
  return point;
}

std::string formulaOf(const Effect& effect) {
  if (!isFormula(effect)) return effect.is_catalogue ? effect.name : "smooth curve, see its table";
  std::string words;
  std::size_t t = 0;
  for (const Term& term : termsOf(effect)) {
    const double value = effect.coefficient[t++];
    const std::string sign = value < 0.0 ? (words.empty() ? "−" : " − ") : (words.empty() ? "" : " + ");
    words += sign + fmt::format("{:.4g} · {}", std::abs(value), inWords(term));
  }
  return words;
}

}  // namespace toftwin::discover
