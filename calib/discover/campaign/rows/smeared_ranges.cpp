// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/smeared_ranges.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "calib/discover/candidates.h"
#include "sim/effects/learned/ranges_around.h"
#include "sim/effects/learned/tables.h"

namespace toftwin::discover {
namespace {

struct Way {
  const char* name;
  float sim::Smears::*part;
  terms::Carrier carrier;
};
constexpr std::array kWays{Way{"across", &sim::Smears::across, terms::Carrier::Across},
                           Way{"along", &sim::Smears::along, terms::Carrier::Along},
                           Way{"around", &sim::Smears::around, terms::Carrier::Around}};
constexpr std::size_t kSmearKnots = 6;  ///< over the amplitude: a filter's threshold is sharp
constexpr float kSmearedShare = 0.01F;

std::string smearedOf(const char* way) { return fmt::format("{}:{}", kSmearedCarrier, way); }

}  // namespace

std::map<std::string, Reading> smearedCarriers(const Reading& declared) {
  std::map<std::string, Reading> all;
  const Image<float>& range_m = declared.range_m;
  const Image<float> none(range_m.width(), range_m.height());
  for (const auto& [way, part, carrier] : kWays) {
    Reading& change = all[smearedOf(way)] = {none, none};
    for (int y = 0; y < range_m.height(); ++y)
      for (int x = 0; x < range_m.width(); ++x)
        change.range_m(x, y) = kSmearedShare * (sim::smearsAt(range_m, x, y).*part);
  }
  return all;
}

std::vector<TermGroup> smearedGroups(std::span<const CovariateInfo> covariates) {
  TermGroup all{"ranges from neighbours", Kind::Generic, {}, 0};
  for (const Way& way : kWays) all.terms.push_back({{}, Stage::Range, smearedOf(way.name)});
  std::vector<TermGroup> groups{all};
  for (const CovariateInfo& covariate : covariates) {
    if (covariate.word != "amplitude") continue;
    TermGroup dim{"ranges from neighbours that go with " + covariate.name, Kind::Generic, all.terms, 0};
    for (const Term& of_amplitude : smoothIn(covariate, kSmearKnots).terms) {
      for (Term term : all.terms) {
        term.factors = of_amplitude.factors;
        dim.terms.push_back(std::move(term));
      }
    }
    groups.push_back(std::move(dim));
  }
  return groups;
}

std::optional<LearnedEffect> smearOf(std::span<const std::pair<Term, double>> terms,
                                     const std::vector<double>& amplitudes) {
  const auto isSmear = [](const auto& one) { return one.first.carrier.starts_with(kSmearedCarrier); };
  // It is one by amplitude; what goes with something else, too, it has no number for.
  const auto isByAmplitude = [](const Factor& factor) { return factor.of.parts.front().covariate == "amplitude_e"; };
  if (std::ranges::none_of(terms, isSmear)) return std::nullopt;
  for (const auto& one : terms)
    if (isSmear(one) && !std::ranges::all_of(one.first.factors, isByAmplitude)) return std::nullopt;
  std::vector<terms::Term> smear;
  for (const Way& way : kWays) {
    std::vector<double> percent;
    for (const double amplitude : amplitudes) {
      double share = 0.0;
      for (const auto& [term, coefficient] : terms)
        if (term.carrier == smearedOf(way.name))
          share += coefficient * term.at([amplitude](const std::string&) { return amplitude; });
      percent.push_back(std::clamp(share, -100.0, 100.0));
    }
    for (terms::Term& term : sim::termsOfSmear(amplitudes, percent, way.carrier)) smear.push_back(std::move(term));
  }
  return LearnedEffect{sim::Learned{.title = {}, .terms = std::move(smear)}, {}};
}

}  // namespace toftwin::discover
