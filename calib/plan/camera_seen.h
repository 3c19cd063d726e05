// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <toftwin/image.h>

#include "calib/compare/traits/traits.h"
#include "calib/plan/range_steps.h"

namespace toftwin::plan {

/// What one camera's frames of a capture say by themselves, against the surfaces that the plan puts before
/// it: the plane through the target, or the walls of a corner. Columns of one kind are of equal length.
struct CameraSeen {
  std::vector<double> starts_s{};    ///< of each frame, device clock; empty where unknown
  std::vector<double> brightness{};  ///< mean amplitude of the image's middle, frame by frame
  /// Mean range of the image's middle, frame by frame, over the pixels that all frames have; empty where none
  /// is.
  std::vector<double> middle_range_m{};
  /// Cells of 8 × 8 pixels of a wall: expected range, error and amplitude.
  std::vector<double> wall_range_m{}, wall_error_mm{}, wall_amplitude{};
  RangeSteps wall_steps{};  ///< the same pixels' errors by their own expected ranges
  /// Readings of a wall, frame by frame: how many, and of them off by whole periods of the highest frequency,
  /// and of all frequencies together.
  double wall_readings = 0.0, wall_wraps = 0.0, wall_beyond = 0.0;
  std::vector<compare::Trait> noise{};  ///< of the frames' errors at the middle of the image
  std::vector<double> corner_place_m{}, corner_range_m{}, corner_error_mm{};
  /// By how much a veil of 1 would move the wall's cells, a column for each frequency beside the wall's; NaN
  /// without an amplitude.
  std::vector<std::vector<double>> wall_veil_mm{};
  Image<float> over_split{};  ///< of a plate before the wall: scaled so that 1 lies halfway between
  std::vector<double> edge_place_px{}, edge_value{};      ///< across the plate's left and right edges
  /// Frame by frame, of a moving plate: when it is where, the middle between the first and the last pixel
  /// that is neither mixed with the wall nor masked; how far these are apart; and how far it seems turned.
  std::vector<double> plate_time_s{}, plate_place_m{}, plate_width_m{}, plate_turn_mm{};
  double plate_pixel_m = 0.0;  ///< how far apart its pixels are on it
  bool is_simulated = false;
};

/// One frame as it was read.
struct ReadFrame {
  std::optional<double> start_s{};
  std::optional<double> since_power_on_s{};
  Image<float> range_m{};
  double brightness = 0.0;
};

}  // namespace toftwin::plan
