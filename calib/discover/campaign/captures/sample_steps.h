// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <toftwin/image.h>

/// Whether a camera's raw exposures come in whole steps. Means over frames do not show it: noise of more than
/// half a step spreads it evenly. Single frames do, with noise and without.
namespace toftwin::discover {

/// The amplitude that one pixel shows in two successive frames.
using AmplitudePair = std::array<float, 2>;

/// Adds those of the dimmest pixels, in which a change of one step is the largest part of the square of the
/// amplitude.
void addDimmest(const Image<float>& before, const Image<float>& after, std::vector<AmplitudePair>& pairs);

struct SampleSteps {
  double step = 0.0;   ///< of a raw exposure, in the unit of the amplitude
  double error = 0.0;  ///< its standard error
  double p = 1.0;      ///< that numbers without steps look as much like steps
};

/// Of four samples q nₖ (whole nₖ) the amplitude is A = |½ Σₖ q nₖ iᵏ|, so that A² is a whole number of q²/4,
/// wherever zero lies and whatever is done to the phase afterwards; of three samples, of 4q²/9. The period is
/// that at which the changes of A² from frame to frame have the largest Rayleigh statistic z = |Σ e^(2πi
/// d/P)|²/n, whose probability by chance is at most e^(−z) for each period that is looked at. Where frames hardly
/// differ, as those of a camera without noise, it is that of the A² themselves.
///
/// Steps from about 1/500 of the dimmest amplitudes, where single precision ends, to a few times the noise.
///
/// Nothing: p > 1e-6; numbers of phase steps other than 3 and 4, of whose squares no grid is known; and
/// amplitudes that are told in whole steps themselves, whose squares lie on a grid whatever the raw exposures
/// are.
std::optional<SampleSteps> sampleStepsOf(std::span<const AmplitudePair> pairs, std::size_t phase_steps);

}  // namespace toftwin::discover
