// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned/correction.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "sim/effects/learned/covariates.h"
#include "sim/effects/learned/ready_correction.h"

namespace toftwin::sim {
namespace {

using terms::Quantity;

/// Why a term cannot be undone in a pixel of a decoded image; empty if it can.
std::string whyNot(const terms::Term& term) {
  switch (term.quantity) {
    case Quantity::RangeMm:
    case Quantity::AmplitudePercent:
      break;
    case Quantity::Value:
      return "it is of a table's values, which are no ranges";
    case Quantity::NoiseMm:
      return "noise cannot be taken off";
    case Quantity::InvalidPercent:
      return "a reading that is lost cannot be brought back";
    default:
      return fmt::format("it acts on the camera's {}, before decoding", wordOf(stageOf(term.quantity)));
  }
  if (term.carrier == terms::Carrier::One) return {};
  return term.carrier == terms::Carrier::Before ? "it goes with the frame before" : "it goes with what other pixels see";
}

}  // namespace

Result<Correction> Correction::of(std::vector<Learned> effects) {
  for (const Learned& effect : effects) {
    if (const std::string problem = effect.problem(); !problem.empty() && effect.stage() == terms::Stage::Range)
      return Error{Error::Code::InvalidArgument, problem};
    for (const terms::Term& term : effect.terms.list())
      if (const std::string why = whyNot(term); !why.empty())
        return Error{Error::Code::Unsupported, fmt::format("\"{}\" cannot be undone: {}", toText(term), why)};
  }
  return Correction{std::move(effects)};
}

Correction::Images Correction::undone(Images measured, const Conditions& now) const {
  return ReadyCorrection{effects_, measured.range_m.width(), measured.range_m.height(), now}.undone(std::move(measured), now);
}

std::vector<std::string> Correction::covariates() const {
  std::vector<terms::Term> all;
  for (const Learned& effect : effects_) all.insert(all.end(), effect.terms.list().begin(), effect.terms.list().end());
  return terms::covariatesOf(all);
}

std::vector<std::string> Correction::unknownOf(const Conditions& now) const {
  std::vector<std::string> unknown = covariates();
  std::erase_if(unknown, [&](const std::string& name) {
    return learnedCovariate(name)->varies != terms::Varies::Frame || !std::isnan(knownOfFrame(name, now).number);
  });
  return unknown;
}

bool Correction::changesAmplitude() const {
  return std::ranges::any_of(effects_, [](const Learned& effect) {
    return std::ranges::any_of(effect.terms.list(), [](const terms::Term& term) {
      return term.quantity == Quantity::AmplitudePercent;
    });
  });
}

}  // namespace toftwin::sim
