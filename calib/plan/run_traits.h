// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "calib/compare/named_traits.h"
#include "calib/plan/run_report.h"

namespace toftwin::plan {

/// A characteristic of a run. Over captures each is a row: of B − A its mean over the
/// pixels that both cameras see, of a camera by itself over its own. Errors of a
/// camera by itself are against the surfaces that the plan puts before it.
using RunTrait = compare::NamedTrait;
using RunTraits = compare::NamedTraits;

/// Characteristics that a page draws.
inline constexpr const char *kDrift = "drift", *kHarmonicsOfWall = "harmonics, against the plan's wall",
                            *kNoiseLaw = "noise law", *kNoiseOverDistance = "temporal noise over distance",
                            *kPatternOverDistance = "fixed pattern over distance",
                            *kPatternOverAmplitude = "fixed pattern over amplitude";

inline constexpr std::array kCameras{"A", "B"};

using Captures = std::vector<const ComparedCapture*>;
/// Those of blocks of a kind, or of all, of which both cameras see a pixel.
Captures capturesOf(const ComparedRun& run, std::string_view kind);
/// Those of blocks of a kind, whatever is seen, also of a plate that moves.
Captures allCapturesOf(const ComparedRun& run, std::string_view kind);

/// Of the blocks of each kind that can tell it: drift (warm_up), harmonics (distance), error over amplitude
/// (exposure), error and noise over ambient light (ambient); of all captures the noise's law and the masks.
RunTraits traitsOf(const ComparedRun& run);

/// What blocks of a kind tell that others do not: "drift" of warm_up.
std::vector<std::string> feedsOf(std::string_view kind);

}  // namespace toftwin::plan
