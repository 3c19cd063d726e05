// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/smeared_ranges.h"

#include <array>
#include <cmath>

#include <fmt/format.h>

#include "calib/discover/candidates.h"

namespace toftwin::discover {
namespace {

constexpr std::array kWays{"across", "along", "around"};
constexpr float kSmearedShare = 0.01F;

std::string smearedOf(const char* way) { return fmt::format("{}:{}", kSmearedCarrier, way); }

/// Shares of the ranges about a pixel, which add up to nothing.
using Stencil = std::array<std::array<float, 3>, 3>;
constexpr Stencil kAcross{{{0, 0, 0}, {0.5F, 0, -0.5F}, {0, 0, 0}}}, kAlong{{{0, 0.5F, 0}, {0, 0, 0}, {0, -0.5F, 0}}},
    kAround{{{0.125F, 0.125F, 0.125F}, {0.125F, -1.0F, 0.125F}, {0.125F, 0.125F, 0.125F}}};

Image<float> changeBy(const Stencil& stencil, const Image<float>& range_m) {
  Image<float> change(range_m.width(), range_m.height());
  for (int y = 1; y + 1 < range_m.height(); ++y) {
    for (int x = 1; x + 1 < range_m.width(); ++x) {
      float sum = 0.0F;
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i)
          if (const float share = stencil[static_cast<std::size_t>(j + 1)][static_cast<std::size_t>(i + 1)];
              share != 0.0F)
            sum += share * range_m(x + i, y + j);
      if (std::isfinite(sum)) change(x, y) = kSmearedShare * sum;
    }
  }
  return change;
}

}  // namespace

std::map<std::string, Reading> smearedCarriers(const Reading& declared) {
  std::map<std::string, Reading> all;
  const std::array stencils{&kAcross, &kAlong, &kAround};
  for (std::size_t way = 0; way < kWays.size(); ++way)
    all[smearedOf(kWays[way])] = {changeBy(*stencils[way], declared.range_m),
                                  Image<float>(declared.range_m.width(), declared.range_m.height())};
  return all;
}

std::vector<TermGroup> smearedGroups(std::span<const CovariateInfo> covariates) {
  TermGroup all{"ranges from neighbours", Kind::Generic, {}, 0};
  for (const char* way : kWays) all.terms.push_back({{}, Stage::Range, smearedOf(way)});
  std::vector<TermGroup> groups{all};
  for (const CovariateInfo& covariate : covariates) {
    if (covariate.word != "amplitude") continue;
    TermGroup dim{"ranges from neighbours that go with " + covariate.name, Kind::Generic, all.terms, 0};
    for (const Term& of_amplitude : smoothIn(covariate, kSurfaceKnots).terms) {
      for (Term term : all.terms) {
        term.factors = of_amplitude.factors;
        dim.terms.push_back(std::move(term));
      }
    }
    groups.push_back(std::move(dim));
  }
  return groups;
}

}  // namespace toftwin::discover
