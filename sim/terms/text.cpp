// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "sim/terms/name_text.h"
#include "sim/terms/term.h"
#include "sim/terms/words.h"

namespace toftwin::terms {
namespace {

/// fmt writes the shortest digits that are read back to the same bits.
std::string numberText(double number) { return fmt::format("{}", number); }

std::string argumentText(const Argument& argument) {
  std::string text;
  for (const auto& [weight, covariate] : argument.parts) {
    const bool is_negative = std::signbit(weight);
    if (!text.empty()) text += is_negative ? " - " : " + ";
    if (text.empty() && is_negative) text += "-";
    if (std::abs(weight) != 1.0) text += numberText(std::abs(weight)) + " * ";
    text += nameText(covariate);
  }
  return text;
}

bool isBare(const Factor& factor) {
  return factor.basis == Basis::Power && factor.numbers == std::vector{1.0} && factor.of.parts.size() == 1 &&
         factor.of.parts[0].weight == 1.0;
}

std::string factorText(const Factor& factor) {
  if (isBare(factor)) return nameText(factor.of.parts[0].covariate);
  std::string text = fmt::format("{}({}", wordOf(factor.basis).word, argumentText(factor.of));
  for (double number : factor.numbers) text += ", " + numberText(number);
  if (factor.basis == Basis::Level) text += ", " + quotedText(factor.level);
  return text + ")";
}

std::string carrierText(const Term& term) {
  std::string numbers;
  for (double number : term.carried) numbers += (numbers.empty() ? "" : ", ") + numberText(number);
  return fmt::format("{}({})", wordOf(term.carrier).word, numbers);
}

}  // namespace

std::string toText(const Term& term) {
  std::string text = fmt::format("{} += {}", wordOf(term.quantity).word, numberText(term.coefficient));
  if (term.carrier != Carrier::One) text += " * " + carrierText(term);
  for (const Factor& factor : term.factors) text += " * " + factorText(factor);
  return text;
}

}  // namespace toftwin::terms
