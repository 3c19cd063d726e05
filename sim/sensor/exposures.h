// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "sim/images/range.h"
#include "sim/images/samples.h"

namespace toftwin::sim {

// Cameras that take each frame with several exposures. Until they are read out, their samples stand
// together in one Samples: all frequencies of the first exposure, then all of the second, …

/// The samples of one exposure out of `count`.
Samples samplesOfExposure(const Samples& all, std::size_t exposure, std::size_t count);

/// Back together; a pixel has the flags of all.
Samples joinExposures(std::span<const Samples> parts);

/// One image of several exposures, pixel by pixel: of those in which it is valid the one with the
/// most signal, and where it is in none the one with the most signal. `exposure` says which was
/// taken, counted from 0.
RangeImage mergeExposures(std::span<const RangeImage> parts);

}  // namespace toftwin::sim
