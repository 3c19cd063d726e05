// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/term.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "sim/terms/words.h"

namespace toftwin::discover {
namespace {

std::string argumentInWords(const terms::Argument& of) {
  std::string words;
  for (const terms::Argument::Part& part : of.parts) {
    words += part.weight < 0.0 ? "−" : words.empty() ? "" : " + ";
    if (std::abs(part.weight) != 1.0) words += fmt::format("{:.4g} ", std::abs(part.weight));
    words += part.covariate;
  }
  return of.parts.size() == 1 && of.parts.front().weight == 1.0 ? words : "(" + words + ")";
}

/// −x without its sign where it has one.
std::string negated(terms::Argument of) {
  for (terms::Argument::Part& part : of.parts) part.weight = -part.weight;
  return argumentInWords(of);
}

std::string powerInWords(const std::string& x, double power) {
  if (power == 1.0) return x;
  if (power == -1.0) return "1/" + x;
  if (power == 0.5) return "√" + x;
  if (power == -0.5) return "1/√" + x;
  return power < 0.0 ? fmt::format("1/{}^{:.4g}", x, -power) : fmt::format("{}^{:.4g}", x, power);
}

}  // namespace

Factor factorOf(std::string covariate, Basis basis, std::vector<double> numbers) {
  return {.basis = basis, .of = {.parts = {{1.0, std::move(covariate)}}}, .numbers = std::move(numbers)};
}

double Term::at(const std::function<double(const std::string&)>& value) const {
  double product = 1.0;
  for (const Factor& factor : factors) {
    double x = 0.0;
    for (const terms::Argument::Part& part : factor.of.parts) x += part.weight * value(part.covariate);
    product *= terms::valueOf(factor, x);
  }
  return product;
}

std::string inWords(const Factor& factor) {
  const std::string x = argumentInWords(factor.of);
  const auto number = [&](std::size_t i) { return fmt::format("{:.4g}", factor.numbers[i]); };
  switch (factor.basis) {
    case Basis::Power:
      return powerInWords(x, factor.numbers[0]);
    case Basis::Log:
      return "ln " + x;
    case Basis::Decay:
      return fmt::format("exp(−{}/{})", x, number(0));
    case Basis::Sine:
      return fmt::format("sin(2π {}/{})", x, number(0));
    case Basis::Cosine:
      return fmt::format("cos(2π {}/{})", x, number(0));
    case Basis::Step:
      return fmt::format("[{} ≥ {}]", x, number(0));
    case Basis::Sigmoid:
      return fmt::format("1/(1 + exp(−({} − {})/{}))", x, number(0), number(1));
    case Basis::Hinge:
      return factor.of.parts.front().weight < 0.0 ? fmt::format("max(0, {:.4g} − {})", -factor.numbers[0], negated(factor.of))
                                     : fmt::format("max(0, {} − {})", x, number(0));
    case Basis::Tangent2:
      return fmt::format("tan²({})", x);
    case Basis::Secant:
      return fmt::format("(1/cos({}) − 1)", x);
    case Basis::Class:
      return fmt::format("[{} mod {} = {}]", x, number(0), number(1));
    default:
      return fmt::format("{}({}; {:.4g})", terms::wordOf(factor.basis).word, x, fmt::join(factor.numbers, ", "));
  }
}

std::string inWords(const Term& term) {
  std::string words = term.carrier;
  for (const Factor& factor : term.factors) words += (words.empty() ? "" : " · ") + inWords(factor);
  return words.empty() ? "1" : words;
}

std::vector<std::string> covariatesOf(const TermGroup& group) {
  std::vector<std::string> names;
  const auto add = [&](const std::string& name) {
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  };
  for (const Term& term : group.terms) {
    if (!term.carrier.empty()) add(term.carrier.substr(0, term.carrier.find(':')));
    for (const Factor& factor : term.factors)
      for (const terms::Argument::Part& part : factor.of.parts) add(part.covariate);
  }
  return names;
}

}  // namespace toftwin::discover
