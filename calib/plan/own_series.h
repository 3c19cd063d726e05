// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "calib/plan/compared_run.h"

namespace toftwin::plan {

/// A camera over the captures of a kind of block, all of them by the same pixels, which it alone chooses:
/// were they those of a capture, or those that the other camera has too, a mean would move with them.
struct OwnSeries {
  std::vector<const ComparedCapture*> captures{};
  std::vector<double> range_mm{};  ///< mean, less that of the first capture
  std::vector<double> noise_mm{};  ///< temporal, median; NaN of a single frame
  /// captures with less than half of the pixels of the one that has most
  std::vector<const ComparedCapture*> left_out{};
  std::size_t pixels = 0;
};

/// Pixels are those that are valid in all captures that are not left out, and in none of them off by
/// kGross_mm of their own median: a period, or what stood before them. `camera`: 0 is A. No captures where
/// there is no such pixel.
OwnSeries ownSeries(const ComparedRun& run, std::string_view kind, std::size_t camera);

}  // namespace toftwin::plan
