// SPDX-License-Identifier: Apache-2.0
#include "sim/terms/words.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fmt/format.h>

namespace toftwin::terms {
namespace {

template <class Rows, class Key, class Value>
const auto& rowOf(const Rows& rows, Key Rows::value_type::*key, Value value) {
  return *std::ranges::find(rows, value, key);
}

bool isWhole(double number) { return std::floor(number) == number; }

std::string problemOfCount(std::string_view word, int wanted, std::string_view numbered, std::size_t count) {
  if (wanted == kAnyCount || static_cast<std::size_t>(wanted) == count) return {};
  if (wanted == 0) return fmt::format("{} takes no number", word);
  return fmt::format("{} needs {}: {} number{} instead of {}", word, numbered, wanted, wanted == 1 ? "" : "s", count);
}

std::string problemOfCurve(const std::vector<double>& numbers) {
  if (numbers.empty() || numbers.size() % 2 != 0) return "curve needs pairs of x and y";
  for (std::size_t i = 2; i < numbers.size(); i += 2)
    if (!(numbers[i] > numbers[i - 2])) return "curve needs an x that ascends from pair to pair";
  return {};
}

}  // namespace

const BasisWord& wordOf(Basis basis) { return rowOf(kBasisWords, &BasisWord::basis, basis); }
const QuantityWord& wordOf(Quantity quantity) { return rowOf(kQuantityWords, &QuantityWord::quantity, quantity); }
const CarrierWord& wordOf(Carrier carrier) { return rowOf(kCarrierWords, &CarrierWord::carrier, carrier); }

std::string problemOf(const Factor& factor) {
  const BasisWord& row = wordOf(factor.basis);
  const auto& n = factor.numbers;
  if (factor.of.parts.empty()) return fmt::format("{} needs a covariate", row.word);
  if (std::string wrong = problemOfCount(row.word, row.numbers, row.numbered, n.size()); !wrong.empty()) return wrong;
  const bool is_hat = factor.basis == Basis::Hat;
  if (!std::ranges::all_of(n, [&](double x) { return is_hat ? !std::isnan(x) : std::isfinite(x); }))
    return fmt::format("{} needs finite numbers", row.word);
  switch (factor.basis) {
    case Basis::Decay:
    case Basis::Sine:
    case Basis::Cosine:
      return n[0] != 0.0 ? "" : fmt::format("{} needs a {} other than 0", row.word, row.numbered);
    case Basis::Sawtooth:
      return n[0] != 0.0 ? "" : "sawtooth needs a period other than 0";
    case Basis::Sigmoid:
    case Basis::Bump:
      return n[1] != 0.0 ? "" : fmt::format("{} needs a width w other than 0", row.word);
    case Basis::Hat:
      return n[0] <= n[1] && n[1] <= n[2] && std::isfinite(n[1]) ? "" : "hat needs a <= b <= c and a finite b";
    case Basis::Curve:
      return problemOfCurve(n);
    case Basis::Class:
      return n[0] >= 1.0 && isWhole(n[0]) && isWhole(n[1]) && n[1] >= 0.0 && n[1] < n[0]
                 ? ""
                 : "class needs whole numbers m >= 1 and 0 <= k < m";
    case Basis::Level:
      return factor.of.parts.size() == 1 && factor.of.parts[0].weight == 1.0 ? "" : "level needs a single covariate";
    default:
      return {};
  }
}

std::string problemOf(const Term& term) {
  if (!std::isfinite(term.coefficient)) return "a coefficient must be finite";
  for (const Factor& factor : term.factors)
    if (std::string wrong = problemOf(factor); !wrong.empty()) return wrong;
  if (term.carrier == Carrier::One) return term.carried.empty() ? "" : "a term without a carrier has numbers of one";
  const CarrierWord& row = wordOf(term.carrier);
  if (std::string wrong = problemOfCount(row.word, row.numbers, row.numbered, term.carried.size()); !wrong.empty())
    return wrong;
  if (!std::ranges::all_of(term.carried, [](double x) { return std::isfinite(x); }))
    return fmt::format("{} needs finite numbers", row.word);
  if (row.numbers > 0 && !(term.carried[0] >= 0.0 && isWhole(term.carried[0])))
    return fmt::format("{} needs a reach of whole pixels, not negative", row.word);
  if (row.of != term.quantity) return fmt::format("{} carries only {}", row.word, wordOf(row.of).word);
  return {};
}

}  // namespace toftwin::terms
