// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/rows/spilled_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include <fmt/format.h>

namespace toftwin::discover {
namespace {

constexpr std::array kSpilledParts{2, 4, 8};  // of the brightest
constexpr double kSpilledShare = 0.01;

std::string spilledOf(int part) { return fmt::format("{}:1/{}", kSpilledCarrier, part); }

}  // namespace

std::map<std::string, Reading> spilledCarriers(const Reading& declared, const Phasors& sources, double period_m,
                                               double brightest) {
  std::map<std::string, Reading> all;
  const Phasors z = phasorOf(declared, period_m);
  for (const int part : kSpilledParts) {
    std::complex<double> sum{};
    for (const std::complex<float>& one : sources.pixels()) {
      const std::complex<double> light{one};
      const double above = 1.0 - brightest / part / std::abs(light);
      if (above > 0.0) sum += above * light;  // not what is NaN
    }
    const std::complex<float> mean{kSpilledShare * sum / static_cast<double>(std::max<std::size_t>(1, z.size()))};
    all[spilledOf(part)] = changeBy(shareOf(z, [&](std::size_t) { return mean; }), period_m);
  }
  return all;
}

TermGroup spilledGroup() {
  TermGroup group{"light spilled by what is too bright", Kind::Generic, {}, 0};
  for (const int part : kSpilledParts) group.terms.push_back({{}, Stage::Light, spilledOf(part)});
  return group;
}

}  // namespace toftwin::discover
