// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/compare/report.h"
#include "calib/compare/traits/traits.h"
#include "calib/plan/run_report.h"

namespace toftwin::plan {

/// A characteristic over a run's captures, each of which is a row: its mean over the pixels that both cameras
/// see. As nobody knows the true range of a real scene, errors are B − A, and drift is each camera's own.
struct RunTrait {
  std::string what{};  ///< "drift, ramp"
  std::string of{};    ///< "A", "B" or "B − A"
  compare::Trait trait{};
};
struct RunTraits {
  std::vector<RunTrait> traits{};
  std::vector<std::string> untold{};  ///< what the captures cannot tell, and why
};

/// Of the blocks of each kind that can tell it: drift (warm_up), harmonics (distance), error over amplitude
/// (exposure), error and noise over ambient light (ambient); of all captures the noise's law and the masks.
RunTraits traitsOf(const ComparedRun& run);

compare::TableBlock traitTable(const RunTraits& traits);
compare::Json toJson(const RunTraits& traits);

}  // namespace toftwin::plan
