// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned/learned.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "sim/effects/learned/covariates.h"

namespace toftwin::sim {
namespace {

using terms::Carrier;
using terms::Quantity;
using terms::Stage;
using terms::Term;
using C = Covariate;

struct DependsOn {
  Quantity quantity;
  Covariates on;
};
/// What an addition to a quantity goes with by itself, relative to the pixel's own signal.
constexpr std::array kOfQuantities{DependsOn{Quantity::AmplitudePercent, {C::Exposure, C::Amplitude}},
                                   DependsOn{Quantity::NoiseMm, {C::Frame}},
                                   DependsOn{Quantity::InvalidPercent, {C::Frame}},
                                   DependsOn{Quantity::OutwardPx, {C::Amplitude, C::Range, C::Position, C::Neighbours}},
                                   DependsOn{Quantity::InPhaseE, {C::Exposure, C::Amplitude}},
                                   DependsOn{Quantity::QuadratureE, {C::Exposure, C::Amplitude}},
                                   DependsOn{Quantity::ChargePercent, {C::Ambient, C::Amplitude, C::Range}}};

struct CarriedBy {
  Carrier carrier;
  Covariates on;
};
constexpr std::array kOfCarriers{CarriedBy{Carrier::Square, {C::Amplitude, C::Range, C::Neighbours}},
                                 CarriedBy{Carrier::Row, {C::Amplitude, C::Range, C::Neighbours}},
                                 CarriedBy{Carrier::Column, {C::Amplitude, C::Range, C::Neighbours}},
                                 CarriedBy{Carrier::Mirror, {C::Amplitude, C::Range, C::Position, C::Neighbours}},
                                 CarriedBy{Carrier::Across, {C::Neighbours}},
                                 CarriedBy{Carrier::Along, {C::Neighbours}},
                                 CarriedBy{Carrier::Around, {C::Range, C::Neighbours}},
                                 CarriedBy{Carrier::Before, {C::Range, C::History}}};

Covariates explainsOfTerm(const Term& term) {
  Covariates all;
  for (const auto& [quantity, on] : kOfQuantities)
    if (quantity == term.quantity) all |= on;
  for (const auto& [carrier, on] : kOfCarriers)
    if (carrier == term.carrier) all |= on;
  for (const std::string& name : terms::covariatesOf({term}))
    if (const LearnedCovariate* known = learnedCovariate(name)) all |= known->explains;
  return all;
}

std::string problemOfCovariates(const Term& term) {
  const Stage stage = stageOf(term.quantity);
  for (const std::string& name : terms::covariatesOf({term})) {
    const LearnedCovariate* known = learnedCovariate(name);
    if (known == nullptr || !isKnownAt(stage, *known))
      return fmt::format("has the term \"{}\", but the simulator knows no \"{}\" {}; it knows there: {}", toText(term), name,
                         known == nullptr ? "" : fmt::format("where {} is made", wordOf(stage)), learnedCovariateNames(stage));
  }
  for (const terms::Factor& factor : term.factors)
    if (factor.basis == terms::Basis::Level)
      return fmt::format("has the term \"{}\", but \"{}\" is a number and has no level '{}': the simulator knows no categories",
                         toText(term), factor.of.parts[0].covariate, factor.level);
  return {};
}

}  // namespace

LearnedTerms LearnedTerms::parsed(const std::vector<std::string>& texts) {
  LearnedTerms read;
  for (const std::string& text : texts) {
    auto term = terms::parseTerm(text);
    if (term) read.terms_.push_back(*std::move(term));
    else if (read.problem_.empty()) read.problem_ = term.error().message;
  }
  return read;
}

std::vector<std::string> LearnedTerms::texts() const {
  std::vector<std::string> all;
  for (const Term& term : terms_) all.push_back(toText(term));
  return all;
}

std::vector<double> LearnedTerms::coefficients() const {
  std::vector<double> all;
  for (const Term& term : terms_) all.push_back(term.coefficient);
  return all;
}

void LearnedTerms::setCoefficients(const std::vector<double>& coefficients) {
  for (std::size_t i = 0; i < std::min(terms_.size(), coefficients.size()); ++i)
    terms_[i].coefficient = coefficients[i];
}

const Term* LearnedTerms::mirror() const {
  const auto found = std::ranges::find(terms_, Carrier::Mirror, &Term::carrier);
  return found == terms_.end() ? nullptr : &*found;
}

void LearnedTerms::setMirror(double right, double down) {
  for (Term& term : terms_)
    if (term.carrier == Carrier::Mirror) term.carried[1] = right, term.carried[2] = down;
}

std::string Learned::problem() const {
  if (!terms.problem().empty()) return "has a " + terms.problem();
  for (const Term& term : terms.list()) {
    if (term.quantity == Quantity::Value)
      return fmt::format("has the term \"{}\", whose value has no unit: a camera adds range_mm", toText(term));
    if (stageOf(term.quantity) != stage())
      return fmt::format("has terms of {} (\"{}\") and of {} (\"{}\"): each needs an [[effect]] of its own", wordOf(stage()),
                         toText(terms.list().front()), wordOf(stageOf(term.quantity)), toText(term));
    if (std::string wrong = problemOfCovariates(term); !wrong.empty()) return wrong;
  }
  return {};
}

Stage Learned::stage() const {
  return terms.list().empty() ? Stage::Range : stageOf(terms.list().front().quantity);
}

Covariates Learned::explains() const {
  Covariates all;
  for (const Term& term : terms.list()) all |= explainsOfTerm(term);
  return all;
}

}  // namespace toftwin::sim
