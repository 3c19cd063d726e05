// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned/tables.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace toftwin::sim {
namespace {

using terms::Argument;
using terms::Basis;
using terms::Carrier;
using terms::Factor;
using terms::Quantity;
using terms::Term;

Argument of(const std::string& covariate) { return {{{1.0, covariate}}}; }

Factor curveOver(const std::string& covariate, const std::vector<double>& knots, const double* values) {
  Factor curve{.basis = Basis::Curve, .of = of(covariate)};
  for (std::size_t i = 0; i < knots.size(); ++i) curve.numbers.insert(curve.numbers.end(), {knots[i], values[i]});
  return curve;
}

/// 1 at knot i and 0 at its neighbours; beyond the first and the last knot 1 as there.
Factor hatAt(const std::string& covariate, const std::vector<double>& knots, std::size_t i) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  return {.basis = Basis::Hat,
          .of = of(covariate),
          .numbers = {i == 0 ? -kInfinity : knots[i - 1], knots[i], i + 1 == knots.size() ? kInfinity : knots[i + 1]}};
}

bool isNothing(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double value) { return value == 0.0; });
}

}  // namespace

std::vector<Term> termsOf(const KnotTable& table, const std::vector<double>& values, Quantity quantity) {
  if (table.knots.empty() || values.empty() || isNothing(values)) return {};
  if (table.and_over.empty())
    return {Term{.quantity = quantity, .coefficient = 1.0, .factors = {curveOver(table.over, table.knots, values.data())}}};
  std::vector<Term> all;
  for (std::size_t i = 0; i < table.knots.size(); ++i) {
    const double* row = values.data() + i * table.and_knots.size();
    all.push_back({.quantity = quantity,
                   .coefficient = 1.0,
                   .factors = {hatAt(table.over, table.knots, i), curveOver(table.and_over, table.and_knots, row)}});
  }
  return all;
}

std::vector<Term> termsOfSquares(const std::vector<double>& reaches_px, const std::vector<double>& percent) {
  std::vector<Term> all;
  for (std::size_t k = 0; k < reaches_px.size(); ++k)
    all.push_back({.quantity = Quantity::LightPercent,
                   .coefficient = percent[k],
                   .carrier = Carrier::Square,
                   .carried = {std::round(reaches_px[k])}});
  return all;
}

std::vector<Term> termsOfMirroredSquares(const std::vector<double>& reaches_px, const std::vector<double>& percent,
                                         double right, double down) {
  std::vector<Term> all = termsOfSquares(reaches_px, percent);
  for (Term& term : all) term.carrier = Carrier::Mirror, term.carried.insert(term.carried.end(), {right, down});
  return all;
}

std::vector<Term> termsOfColumns(const std::vector<double>& values, Quantity quantity) {
  std::vector<Term> all;
  for (std::size_t j = 0; j < values.size(); ++j) {
    if (values[j] == 0.0) continue;
    const std::vector<double> numbers{static_cast<double>(values.size()), static_cast<double>(j)};
    all.push_back({.quantity = quantity,
                   .coefficient = values[j],
                   .factors = {{.basis = Basis::Class, .of = of("column"), .numbers = numbers}}});
  }
  return all;
}

std::vector<Term> termsOfSmear(const std::vector<double>& amplitudes_e, const std::vector<double>& percent, Carrier carrier) {
  if (amplitudes_e.empty() || isNothing(percent)) return {};
  return {Term{.quantity = Quantity::RangeMm,
               .coefficient = 0.01,
               .carrier = carrier,
               .factors = {curveOver("amplitude_e", amplitudes_e, percent.data())}}};
}

}  // namespace toftwin::sim
