// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "calib/plan/captures.h"

namespace toftwin::plan {

/// One covariate of some captures, as the design has it: exposure as its logarithm, because effects go with
/// ratios of signal.
struct Covariate {
  std::string name;
  std::string unit;
  bool is_time = false;  ///< time itself, or what time does
  std::vector<double> values;
  std::vector<double> shown;  ///< in its unit
};

/// Time, warming up, distance, angle, exposure, ambient, in this order. `which`: numbers of captures.
std::vector<Covariate> covariatesOf(const Plan& plan, const Schedule& schedule,
                                    const std::vector<std::size_t>& which);

/// Whether it takes more than one value.
bool changes(const Covariate& covariate);

}  // namespace toftwin::plan
