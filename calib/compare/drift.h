// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "calib/compare/characteristics.h"

namespace toftwin::compare {

/// What changed between the first and the last visit of one place, over the pixels compared at both:
/// nothing but time lies between them, so it is told apart from how the cameras differ from place to
/// place.
struct Drift {
  std::size_t first = 0, last = 0;  ///< of the poses
  std::size_t pixels = 0;
  double a_mm = 0.0, b_mm = 0.0;  ///< how A's and B's mean range changed
  double difference_mm = 0.0;     ///< how B − A changed
  double error_mm = 0.0;          ///< its standard error by spatial blocks
};

/// One for each place that was visited more than once.
std::vector<Drift> driftsOf(const std::vector<PoseComparison>& poses);
Json toJson(const std::vector<Drift>& drifts);

}  // namespace toftwin::compare
