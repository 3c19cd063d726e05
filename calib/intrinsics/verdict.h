// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/file/calibration_file.h"
#include "calib/intrinsics/coverage.h"
#include "calib/intrinsics/estimate.h"

namespace toftwin::intrinsics {

/// Everything that one calibration came to.
struct Calibrated {
  Target target{};
  ImageSize size{};
  std::vector<Sighting> sightings{};
  Estimate estimate{};
  std::string camera{};   ///< for the file: the source, or where the images are from
  bool was_model_asked = false;
};

/// What a user must know before trusting it: over-fitting, extrapolation, too few or too similar views.
std::vector<std::string> warningsOf(const Calibrated& calibrated);

/// The outcome in words and tables, for a terminal.
std::string describe(const Calibrated& calibrated);

/// As it is stored. `made`: the time in UTC.
calibration::CalibrationFile fileOf(const Calibrated& calibrated, const std::string& made);

}  // namespace toftwin::intrinsics
