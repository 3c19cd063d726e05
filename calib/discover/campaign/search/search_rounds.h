// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>

#include <toftwin/result.h>

#include "calib/discover/campaign/search/round.h"

namespace toftwin::discover {

/// Searches, and once more from where the fit ended, if something is left beside what was found or if effects
/// were found beside wrong numbers: poses, delay and numbers that are far off leave what is not linear in
/// them, and that looks like an effect. Where the first round leaves much, or poses far off, a strong effect
/// may have gone into them before it was found: all begins again at the poses as they were stated, and that
/// counts if it leaves neither. `file`: the camera file, with the delay of the light as it fits without any
/// effect. `begin` is called between the first round's phases: trace, vary, find, fit.
Result<std::unique_ptr<Round>> searchInRounds(const Declared& file, const OpenCaptures& open,
                                              const std::function<void()>& begin,
                                              const std::function<void(double)>& tell);

}  // namespace toftwin::discover
