// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "sim/terms/term.h"
#include "sim/terms/words.h"

namespace toftwin::terms {

/// Draws terms of every basis, carrier and quantity whose numbers mean something.
class RandomTerms {
 public:
  explicit RandomTerms(std::uint64_t seed) : engine_(seed) {}

  double between(double low, double high) { return std::uniform_real_distribution{low, high}(engine_); }
  int upTo(int last) { return std::uniform_int_distribution{0, last}(engine_); }
  bool oneIn(int count) { return upTo(count - 1) == 0; }

  /// About x from `low` to `high`, so that the basis changes there.
  Factor factor(Basis basis, Argument of, double low, double high) {
    const double span = high - low, a = between(low, high), w = between(0.05, 0.5) * span;
    Factor factor{.basis = basis, .of = std::move(of)};
    switch (basis) {
      case Basis::Power:
        factor.numbers = {oneIn(2) ? 1.0 + upTo(1) : between(-1.5, 1.5)};
        break;
      case Basis::Decay:
      case Basis::Sine:
      case Basis::Cosine:
        factor.numbers = {w};
        break;
      case Basis::Step:
      case Basis::Hinge:
        factor.numbers = {a};
        break;
      case Basis::Sawtooth:
        factor.numbers = {w, a};
        break;
      case Basis::Sigmoid:
      case Basis::Bump:
        factor.numbers = {a, w};
        break;
      case Basis::Hat:
        factor.numbers = {a - w, a, a + between(0.05, 0.5) * span};
        if (oneIn(4)) factor.numbers[0] = -kInfinity;
        if (oneIn(4)) factor.numbers[2] = kInfinity;
        break;
      case Basis::Curve:
        for (double x = a - 2.0 * w; x < high && factor.numbers.size() < 40; x += between(0.02, 0.3) * span)
          factor.numbers.insert(factor.numbers.end(), {x, between(-1.0, 1.0)});
        break;
      case Basis::Class: {
        const int m = 1 + upTo(8);
        factor.numbers = {static_cast<double>(m), static_cast<double>(upTo(m - 1))};
        break;
      }
      case Basis::Level:
        factor.level = oneIn(2) ? "tof0" : "it's 'b'";
        break;
      case Basis::Log:
      case Basis::Secant:
      case Basis::Tangent2:
        break;
    }
    return factor;
  }

  std::string name() {
    const std::vector<std::string> names{"range_mm", "column", "t_2", "plate (mm)", "it's", "2nd run", "inf", "größe", ""};
    return names[static_cast<std::size_t>(upTo(static_cast<int>(names.size()) - 1))];
  }
  Argument argument(bool is_single) {
    Argument argument{{{1.0, name()}}};
    if (is_single) return argument;
    for (int more = upTo(2); more > 0; --more) argument.parts.push_back({weight(), name()});
    if (oneIn(4)) argument.parts[0].weight = weight();
    return argument;
  }
  double weight() { return oneIn(2) ? (oneIn(2) ? 1.0 : -1.0) : between(-3.0, 3.0); }

  Term term(Quantity quantity) {
    Term term{.quantity = quantity, .coefficient = between(-20.0, 20.0)};
    for (int count = upTo(3); count > 0; --count) {
      const Basis basis = kBasisWords[static_cast<std::size_t>(upTo(kBasisWords.size() - 1))].basis;
      term.factors.push_back(factor(basis, argument(basis == Basis::Level), 500.0, 4000.0));
    }
    if (!oneIn(3)) return term;
    const CarrierWord& carrier = kCarrierWords[static_cast<std::size_t>(upTo(kCarrierWords.size() - 1))];
    if (carrier.of != quantity) return term;
    term.carrier = carrier.carrier;
    for (int i = 0; i < carrier.numbers; ++i) term.carried.push_back(i == 0 ? upTo(30) : between(-5.0, 5.0));
    return term;
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::mt19937_64 engine_;
};

}  // namespace toftwin::terms
