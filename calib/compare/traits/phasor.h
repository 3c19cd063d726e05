// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/compare/traits/traits.h"

namespace toftwin::compare {

/// Whether the amplitude is below ten standard errors, from where on the delta method is as good.
bool isNearNothing(const WaveParts& phasor);

/// A = √(a² + b²) in mm of two parts that err alike by σ. A²/2σ² is of a noncentral F distribution with 2 and
/// ν degrees and noncentrality A₀²/σ²: its inversion, as √ is not straight near 0, and an A₀ of 0 is seen
/// as 1.25 σ on the mean. `wider`: the interval holds as a normal one that is widened by so much.
Trait amplitudeOf(const WaveParts& phasor, double wider = 1.0);

}  // namespace toftwin::compare
