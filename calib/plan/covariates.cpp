// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/covariates.h"

#include <algorithm>
#include <cmath>

namespace toftwin::plan {

std::vector<Covariate> covariatesOf(const Plan& plan, const Schedule& schedule,
                                    const std::vector<std::size_t>& which) {
  std::vector<Covariate> all{{"time", "s", true, {}, {}},       {"warm-up", "1", true, {}, {}},
                             {"distance", "m", false, {}, {}},  {"angle", "deg", false, {}, {}},
                             {"exposure", "us", false, {}, {}}, {"ambient", "klx", false, {}, {}}};
  const auto add = [&](std::size_t i, double value, double shown) {
    all[i].values.push_back(value), all[i].shown.push_back(shown);
  };
  for (const std::size_t number : which) {
    const PlannedCapture& one = schedule.captures[number];
    const Duration middle = one.start + 0.5 * one.duration;
    // How warm it is, from 0 to 1: 1 − e^(−t/τ).
    const double warm = 1.0 - std::exp(-middle.in(second) / plan.warm_up_time.in(second));
    const double exposure = one.exposure.in(microsecond), ambient = one.ambient.in(kilolux);
    add(0, middle.in(second), middle.in(second));
    add(1, warm, warm);
    add(2, one.distance_m, one.distance_m);
    add(3, one.angle_deg, one.angle_deg);
    add(4, std::log(std::max(exposure, 1e-3)), exposure);
    add(5, ambient, ambient);
  }
  return all;
}

bool changes(const Covariate& covariate) {
  const auto [least, most] = std::ranges::minmax(covariate.values);
  return most - least > 1e-9 * (1.0 + std::abs(most));
}

}  // namespace toftwin::plan
