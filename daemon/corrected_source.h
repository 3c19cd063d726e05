// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <toftwin/result.h>

#include "drivers/source.h"
#include "sim/correction/learned_correction.h"

namespace toftwin::daemon {

/// The same source with the learned errors taken off Range and Depth (and Amplitude, of terms of it) in each frame, which
/// provenance tells. A frame that was corrected before, as in a replay of a corrected source, is left as it is.
Result<std::unique_ptr<drivers::Source>> corrected(std::shared_ptr<const sim::LearnedCorrection> correction,
                                                   Result<std::unique_ptr<drivers::Source>> opened);

}  // namespace toftwin::daemon
