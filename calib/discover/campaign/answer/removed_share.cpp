// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/answer/removed_share.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <toftwin/nan.h>

#include "calib/compare/statistics.h"

namespace toftwin::discover {
namespace {

/// A normal deviate of which is known that it is not less than `least`; for one far out by C. P. Robert, Stat. Comput.
/// 5 (1995) 121, with an exponential.
double normalFrom(double least, std::mt19937_64& engine) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const double rate = 0.5 * (least + std::sqrt(least * least + 4.0));
  for (;;) {
    if (least <= 0.0) {
      if (const double z = normal(engine); z >= least) return z;
      continue;
    }
    const double z = least - std::log1p(-uniform(engine)) / rate;
    if (uniform(engine) <= std::exp(-0.5 * (z - rate) * (z - rate))) return z;
  }
}

}  // namespace

double shareOf(const Balance& balance) {
  const double all = balance.removed + std::max(0.0, balance.left);
  return all > 0.0 ? balance.removed / all : kNaN;
}

ShareInterval intervalOf(const Balance& balance, const Balance& sigma) {
  if (!(sigma.left > 0.0) || !std::isfinite(balance.left / sigma.left)) return {kNaN, kNaN};  // no row says anything
  constexpr int kDraws = 4000;
  constexpr std::uint64_t kSeed = 20'262;
  std::mt19937_64 engine{kSeed};
  std::normal_distribution<double> normal;
  std::vector<double> low, high;
  const auto add = [](double share, std::vector<double>& to) {
    if (std::isfinite(share)) to.push_back(share);
  };
  for (int k = 0; k < kDraws; ++k) {
    const double removed = balance.removed + sigma.removed * normal(engine);
    add(shareOf({removed, balance.left + sigma.left * normal(engine)}), high);
    add(shareOf({removed, balance.left + sigma.left * normalFrom(-balance.left / sigma.left, engine)}), low);
  }
  return {compare::quantile(std::move(low), 0.025), compare::quantile(std::move(high), 0.975)};
}

}  // namespace toftwin::discover
