// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calib/discover/campaign/search/campaign_finding.h"

/// Whether some frames differ from the others that were taken with them: every second one, one in seven, the first of
/// each capture. Means over the frames hide it, and take a share of it for the camera's.
namespace toftwin::discover {

/// Frames that differ from the others of their captures, as a whole.
struct FramesApart {
  FrameClass which{};
  std::size_t frames = 0, captures = 0;  ///< of the class, and of how many captures
  /// Farther and brighter than the others, with standard errors, beside straight drifts of all. None where no two
  /// captures have frames of both kinds that tell it, as of a camera without amplitude.
  std::optional<Difference> range_mm{}, gain_percent{};
  double p = 1.0;  ///< that frames in any order differ as much

  /// Whether they are a minority, without which the others are a camera of their own.
  [[nodiscard]] bool isMinority() const { return which.kind == FrameClass::Kind::AtPlace || which.period > 2; }
  /// "every 7th frame", "the 1st frame of each capture".
  [[nodiscard]] std::string inWords() const;
};

/// The class that differs most: one place in each capture, the 1st to the 16th; every 2nd to 4th from the first of each
/// capture; numbers modulo 2 to 16 as the source counts them. Where two are the same frames, the one that comes first
/// here. Each is judged by its largest sum of range and gain, in units of their spread within captures, straight drifts
/// within captures taken off; those of the source by the sum of their sizes, too, beyond those of the same place in
/// other captures. A sum is told in its deviations, of frames in any order, or, by the source, as it scatters from
/// capture to capture if that is more; its chance is that of the largest where the frames of each capture are put in
/// another order, 2000 times. Nothing: p > 0.002; fewer than six captures of six frames.
std::optional<FramesApart> framesApart(const std::vector<MeasuredCapture>& captures, std::uint64_t seed);

/// What was found of single frames, as an effect.
FoundEffect effectOf(const FramesApart& apart);

}  // namespace toftwin::discover
