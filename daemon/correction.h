// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <toftwin/result.h>

#include "drivers/source.h"
#include "sim/effects/learned/correction.h"

namespace toftwin::daemon {

/// What a [[source]]'s key `correction` names: learned terms to be taken off its ranges.
struct LearnedCorrection {
  sim::Correction terms;
  std::string name;  ///< "model.toml (1a2b3c4d)": the file and the beginning of its terms' hash
};

/// Reads the terms of all [[effect]] tables of a file that `toftwin discover` wrote, as one sum; other keys are of no matter. Errors name
/// file, line and what cannot be taken off a camera's frames: effects that are not learned, terms that cannot be undone,
/// covariates that no frame tells.
Result<std::shared_ptr<const LearnedCorrection>> readCorrection(const std::filesystem::path& file);

/// What of it these planes cannot have, or nothing: a range or a depth is needed, an amplitude where a term goes with it.
std::string problemWith(const LearnedCorrection& correction, const std::vector<PlaneKind>& planes);

/// The same source with the learned errors taken off Range and Depth (and Amplitude, of terms of it) in each frame, which
/// provenance tells. A frame that was corrected before, as in a replay of a corrected source, is left as it is.
Result<std::unique_ptr<drivers::Source>> corrected(std::shared_ptr<const LearnedCorrection> correction,
                                                   Result<std::unique_ptr<drivers::Source>> opened);

}  // namespace toftwin::daemon
