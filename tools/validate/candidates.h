// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/validate/judged.h"

namespace toftwin::validate {

/// Rows of errors in order of nothing in particular, and what simulates them for a camera.
struct ErrorRows {
  const std::vector<double>& at_mm;     ///< what blocks are made along
  const std::vector<double>& error_mm;  ///< measured − reference
  double block_mm = 100.0;
  const sim::SensorModel& camera;       ///< without noise
  std::function<std::vector<double>(const sim::SensorModel&)> simulate;
};

/// Effects that the camera lacks, of those candidates, fitted to the rows through the simulator: one after the other is
/// switched on while cross-validation within the fitted half gains 2 %; then all their numbers are fitted together. On
/// alternate blocks, and the other way round. Adds a table, the outcome and the ablations.
void addCandidates(const std::string& data, const ErrorRows& rows, const std::vector<EffectGroup>& candidates,
                   std::size_t at_most, Judged& judged);

}  // namespace toftwin::validate
