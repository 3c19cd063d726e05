// SPDX-License-Identifier: Apache-2.0
#include "sim/terms/term.h"

#include <algorithm>
#include <cmath>

#include <toftwin/nan.h>

#include "sim/terms/words.h"

namespace toftwin::terms {
namespace {

double valueOfLevel(const Factor& factor, const Lookup& lookup) {
  if (factor.of.parts.empty()) return kNaN;
  const Known known = lookup(factor.of.parts.front().covariate);
  if (known.name.empty() && std::isnan(known.number)) return kNaN;
  return known.name == factor.level ? 1.0 : 0.0;
}

}  // namespace

Stage stageOf(Quantity quantity) { return wordOf(quantity).stage; }

double valueOf(const Factor& factor, const Lookup& lookup) {
  if (factor.basis == Basis::Level) return valueOfLevel(factor, lookup);
  double x = 0.0;
  for (const auto& [weight, covariate] : factor.of.parts) x += weight * lookup(covariate).number;
  return valueOf(factor, x);
}

double valueOf(const Term& term, const Lookup& lookup) {
  double product = term.coefficient;
  for (const Factor& factor : term.factors) product *= valueOf(factor, lookup);
  return product;
}

double sumOf(const std::vector<Term>& terms, const Lookup& lookup) {
  double sum = 0.0;
  for (const Term& term : terms) {
    const double value = valueOf(term, lookup);
    if (!std::isnan(value)) sum += value;
  }
  return sum;
}

std::vector<std::string> covariatesOf(const std::vector<Term>& terms) {
  std::vector<std::string> names;
  for (const Term& term : terms)
    for (const Factor& factor : term.factors)
      for (const auto& part : factor.of.parts)
        if (std::ranges::find(names, part.covariate) == names.end()) names.push_back(part.covariate);
  return names;
}

}  // namespace toftwin::terms
