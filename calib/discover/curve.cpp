// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/curve.h"

#include <cmath>

#include <fmt/format.h>

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

}  // namespace

Point effectAt(const Effect& effect, const std::map<std::string, double>& at) {
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
      const double step = 1e-4 * (std::abs(moved[i]) + 1e-12);
      moved[i] += step;
      if (inner < numbers) slope(inner++) = (partAt(part, coefficient, moved, at) - here) / step;
    }
  }
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
