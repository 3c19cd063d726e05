// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "calib/plan/compared_run.h"

namespace toftwin::plan {

/// Of the blocks of each kind that can tell it: drift (warm_up), harmonics (distance), error over amplitude
/// (exposure), error and noise over ambient light (ambient); of all captures the noise's law and the masks.
RunTraits traitsOf(const ComparedRun& run);

/// What blocks of a kind tell that others do not: "drift" of warm_up.
std::vector<std::string> feedsOf(std::string_view kind);

}  // namespace toftwin::plan
