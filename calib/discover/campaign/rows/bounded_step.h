// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "calib/discover/campaign/captures/effect_numbers.h"
#include "calib/discover/campaign/rows/told_apart.h"

namespace toftwin::discover {

/// A step of the free numbers, in units of their own steps, and by how much χ² falls with it where all is as linear as
/// here.
struct BoundedStep {
  Eigen::VectorXd change{};
  double promised = 0.0;
};

/// Levenberg's and Marquardt's step within the numbers' bounds: what would leave them ends there, and the others are
/// solved again with it there. What is at a bound and would go on promises nothing.
BoundedStep boundedStep(const std::vector<sim::AnyEffect>& effects, const std::vector<FreeNumber>& free,
                        const NormalEquations& at, double damping);

}  // namespace toftwin::discover
