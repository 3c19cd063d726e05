// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/traits/phasor.h"

#include <algorithm>
#include <boost/math/distributions/non_central_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <numbers>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {
namespace {

/// The A₀/σ of which so large a share of runs show less than `at`; 0 where even that of none does not.
double inverted(double degrees, double at, double share) {
  const auto below = [&](double wanted) {
    return boost::math::cdf(boost::math::non_central_f{2.0, degrees, wanted * wanted}, 0.5 * at * at);
  };
  double low = 0.0, high = at + 10.0;
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    (below(std::max(middle, 1e-9)) > share ? low : high) = middle;
  }
  return low;
}

}  // namespace

bool isNearNothing(const WaveParts& phasor) {
  return phasor.sigma > 0.0 && std::hypot(phasor.cosine, phasor.sine) <= 10.0 * phasor.sigma;
}

Trait amplitudeOf(const WaveParts& phasor, double wider) {
  const boost::math::normal normal;
  const double level =
      1.0 - 2.0 * boost::math::cdf(complement(normal, wider * boost::math::quantile(normal, 0.975)));
  const double value = std::hypot(phasor.cosine, phasor.sine);
  const double half = studentT(phasor.degrees, level) * phasor.sigma;
  Trait trait{.name = "amplitude", .unit = "mm", .value = value, .low = value - half, .high = value + half};
  if (!isNearNothing(phasor)) return trait;
  const double seen = value / phasor.sigma, share = 0.5 + 0.5 * level;
  trait.low = phasor.sigma * inverted(phasor.degrees, seen, share);
  // Less than noise alone shows on the mean does not prove that there is less than nothing.
  trait.high =
      phasor.sigma * inverted(phasor.degrees, std::max(seen, std::sqrt(0.5 * std::numbers::pi)), 1.0 - share);
  return trait;
}

}  // namespace toftwin::compare
