// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calib/discover/campaign/discover_campaign.h"

/// Whether some frames differ from the others that were taken with them: every second one, one in seven, the first of each
/// capture. Means over the frames hide it, and take a share of it for the camera's.
namespace toftwin::discover {

/// Frames that differ from the others of their captures, as a whole.
struct FramesApart {
  FrameClass which{};
  std::size_t frames = 0, captures = 0;  ///< of the class, and of how many captures
  Difference range_mm{}, gain_percent{};  ///< farther and brighter than the others, with standard errors
  double p = 1.0;  ///< that frames in any order differ as much

  /// Whether they are a minority, without which the others are a camera of their own.
  [[nodiscard]] bool isMinority() const { return which.period > 2; }
  /// "every 7th frame", "the first frame of each capture".
  [[nodiscard]] std::string inWords() const;
};

/// The class that differs most: numbers modulo 2 to 16, counted by the source or from the first of each capture, and the
/// first frames of captures themselves. Its statistic is the largest sum of a class's values, or of their squares, range and
/// gain each for itself in units of their spread within captures, straight drifts within captures taken off; its chance,
/// that of the largest where the frames of each capture are put in another order, 2000 times. Nothing: p > 0.002; fewer
/// than three captures of four frames.
std::optional<FramesApart> framesApart(const std::vector<MeasuredCapture>& captures, std::uint64_t seed);

/// What was found of single frames, as an effect.
FoundEffect effectOf(const FramesApart& apart);

}  // namespace toftwin::discover
