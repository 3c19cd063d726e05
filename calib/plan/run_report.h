// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include <toftwin/result.h>

#include "calib/compare/finding.h"
#include "calib/compare/same_frames.h"
#include "calib/plan/compare_run.h"
#include "calib/plan/run_settings.h"

namespace toftwin::plan {

/// The compared captures of a run, in its order.
struct ComparedRun {
  std::string plan;  ///< its name
  std::vector<ComparedCapture> captures;
  std::vector<ComparedCapture> moving{};  ///< of a plate that moves: not compared pixel by pixel
  std::vector<std::pair<std::string, compare::PoseComparison>>
      examples;  ///< whole images, a capture of each block
  /// Modulation frequencies of A and B, by the first capture's frames; empty: none is told.
  std::array<std::vector<double>, 2> frequency_hz{};
  std::vector<std::string> warnings;
  std::vector<RunSetting> settings{};  ///< what it was made with
  bool is_locked = false;  ///< of the locked captures
};

/// Error where nothing can be compared: no pixel valid in both at any capture.
Result<compare::Finding> judgeRun(const ComparedRun& run);
/// Of all its captures: whether A and B are two cameras.
compare::SameFrames sameFramesOf(const ComparedRun& run);

}  // namespace toftwin::plan
