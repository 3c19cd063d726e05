// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/term.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace toftwin::discover {
namespace {

double hat(double x, double a, double b, double c) {
  if (x <= b) return a >= b || x <= a ? (a >= b ? 1.0 : 0.0) : (x - a) / (b - a);
  return c <= b || x >= c ? (c <= b ? 1.0 : 0.0) : (c - x) / (c - b);
}

}  // namespace

double Factor::at(double x) const {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  const auto number = [&](std::size_t i) { return numbers[i]; };
  switch (shape) {
    case Shape::Power:
      return number(0) == 1.0 ? x : std::pow(x, number(0));
    case Shape::Log:
      return std::log(x);
    case Shape::Decay:
      return std::exp(-(x - number(1)) / number(0));
    case Shape::Sine:
      return std::sin(kTurn * x / number(0));
    case Shape::Cosine:
      return std::cos(kTurn * x / number(0));
    case Shape::Step:
      return x >= number(0) ? 1.0 : 0.0;
    case Shape::Sigmoid:
      return 1.0 / (1.0 + std::exp(-(x - number(0)) / number(1)));
    case Shape::Hinge:
      return std::max(0.0, number(1) * (x - number(0)));
    case Shape::TanSquared:
      return std::pow(std::tan(number(0) * x), 2);
    case Shape::Secant:
      return 1.0 / std::cos(number(0) * x) - 1.0;
    case Shape::Hat:
      return hat(x, number(0), number(1), number(2));
    case Shape::Equal:
      return x == number(0) ? 1.0 : 0.0;
    case Shape::Modulo: {
      const double left = std::fmod(std::floor(x), number(0));
      return (left < 0.0 ? left + number(0) : left) == number(1) ? 1.0 : 0.0;
    }
  }
  return 0.0;
}

double Term::at(const std::function<double(const std::string&)>& value) const {
  double product = 1.0;
  for (const Factor& factor : factors) product *= factor.at(value(factor.covariate));
  return product;
}

std::string inWords(const Factor& factor) {
  const auto& x = factor.covariate;
  const auto number = [&](std::size_t i) { return fmt::format("{:.4g}", factor.numbers[i]); };
  switch (factor.shape) {
    case Shape::Power:
      if (factor.numbers[0] == 1.0) return x;
      if (factor.numbers[0] == -1.0) return "1/" + x;
      if (factor.numbers[0] == -0.5) return "1/√" + x;
      if (factor.numbers[0] < 0.0) return fmt::format("1/{}^{:.4g}", x, -factor.numbers[0]);
      return factor.numbers[0] == 0.5 ? fmt::format("√{}", x) : fmt::format("{}^{}", x, number(0));
    case Shape::Log:
      return fmt::format("ln {}", x);
    case Shape::Decay:
      if (factor.numbers[1] == 0.0) return fmt::format("exp(−{}/{})", x, number(0));
      return fmt::format("exp(−({} − {})/{})", x, number(1), number(0));
    case Shape::Sine:
      return fmt::format("sin(2π {}/{})", x, number(0));
    case Shape::Cosine:
      return fmt::format("cos(2π {}/{})", x, number(0));
    case Shape::Step:
      return fmt::format("[{} ≥ {}]", x, number(0));
    case Shape::Sigmoid:
      return fmt::format("1/(1 + exp(−({} − {})/{}))", x, number(0), number(1));
    case Shape::Hinge:
      return factor.numbers[1] > 0.0 ? fmt::format("max(0, {} − {})", x, number(0))
                                     : fmt::format("max(0, {} − {})", number(0), x);
    case Shape::TanSquared:
      return fmt::format("tan²({})", x);
    case Shape::Secant:
      return fmt::format("(1/cos({}) − 1)", x);
    case Shape::Hat:
      return fmt::format("hat({}; {}, {}, {})", x, number(0), number(1), number(2));
    case Shape::Equal:
      return fmt::format("[{} = {}]", x, number(0));
    case Shape::Modulo:
      return fmt::format("[{} mod {} = {}]", x, number(0), number(1));
  }
  return x;
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
    for (const Factor& factor : term.factors) add(factor.covariate);
  }
  return names;
}

}  // namespace toftwin::discover
