// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "calib/discover/campaign/search/campaign_finding.h"

/// Whether frames are late and early, or bright and dark, in a wave that goes over them, in whatever number of frames:
/// as where a supply's ripple or a lamp beats with them. A wave of a whole number of them shows as frames that are
/// apart, too (frames_apart.h).
namespace toftwin::discover {

struct FramesBeat {
  Difference period{};  ///< in frames; what is faster than two frames looks slower
  std::size_t captures = 0;
  /// Its amplitude, where it is seen in the range or in the gain.
  std::optional<Difference> range_mm{}, gain_percent{};
  double p = 1.0;  ///< that frames in any order have such a wave
};

/// The frequency at which most captures have more power than one turn a capture beside it on either side (the mean of
/// both), summed over captures of eight frames or more, longer ones in pieces of 32; no phase is common to them. What
/// wanders has a spectrum that is convex there, a step or a parabola likewise: it falls short of its neighbours' mean,
/// between 0.15 turns a frame (or 2.25 a piece) and one turn less than half the frames. Its chance is that of the
/// largest where the frames of each capture are put in another order, 2000 times. Nothing: as large in one of these, or
/// less than four deviations; fewer than six captures. Amplitudes are those of the power, A² = 4 P/n, with its scatter
/// over captures; the period's error is that of the best estimate of a sine's frequency beside white noise (D. C. Rife,
/// R. R. Boorstyn, IEEE Trans. Inf. Theory 20 (1974) 591).
std::optional<FramesBeat> framesBeat(const std::vector<MeasuredCapture>& captures, std::uint64_t seed);

/// What was found of single frames, as an effect.
FoundEffect effectOf(const FramesBeat& beat);

}  // namespace toftwin::discover
