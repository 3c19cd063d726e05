// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "calib/compare/report.h"
#include "calib/compare/traits/traits.h"
#include "calib/plan/run_report.h"

namespace toftwin::plan {

/// A characteristic of a run. Over captures each is a row: its mean over the pixels that both cameras see. Errors of a
/// camera by itself are against the surfaces that the plan puts before it.
struct RunTrait {
  std::string what{};    ///< "drift"
  std::string detail{};  ///< what may be another in the next run: the model that was chosen, "at 1.5 m"
  std::string of{};      ///< "A", "B" or "B − A"
  compare::Trait trait{};
};
struct RunTraits {
  std::vector<RunTrait> traits{};
  std::vector<std::string> untold{};  ///< what the captures cannot tell, and why
};

/// Of the blocks of each kind that can tell it: drift (warm_up), harmonics (distance), error over amplitude
/// (exposure), error and noise over ambient light (ambient); of all captures the noise's law and the masks.
RunTraits traitsOf(const ComparedRun& run);

/// What blocks of a kind tell that others do not: "drift" of warm_up.
std::vector<std::string> feedsOf(std::string_view kind);

compare::TableBlock traitTable(const RunTraits& traits);
compare::Json toJson(const RunTraits& traits);

}  // namespace toftwin::plan
