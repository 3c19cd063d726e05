// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include <toftwin/result.h>

#include "calib/plan/compared_run.h"
#include "calib/plan/plan.h"

namespace toftwin::plan {

/// Reads both recordings of a capture and compares them pixel by pixel. Errors name the capture: a file that
/// is missing, damaged or not the one that the index names, poses that disagree, fields of view that do not
/// overlap. `whole`: also gives the comparison of all pixels. A plate that moves is not compared pixel by pixel.
struct CompareHow {
  int stride = 1;
  std::array<std::vector<double>, 2>
      frequency_hz{};  ///< of A's and B's modulation, ascending; empty: not known
};
Result<ComparedCapture> compareCapture(const std::filesystem::path& run, const Plan& plan,
                                       const CaptureRecord& record, const CompareHow& how,
                                       compare::PoseComparison* whole = nullptr);

/// Error where a recording is missing or not the one that was captured.
Result<> checkHash(const std::filesystem::path& run, const RecordedFile& file);

}  // namespace toftwin::plan
