// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "calib/discover/campaign/answer/judged_regions.h"
#include "sim/effects/effects.h"

namespace toftwin::discover {

/// Range errors of a model over the pixels of captures that it has not seen, measured − simulated.
struct RangeErrors {
  std::size_t pixels = 0;
  double bias_mm = 0.0, rms_mm = 0.0, p95_mm = 0.0;
  double masks_agree = 0.0;  ///< share of the pixels where both are valid or both are not
  double per_row =
      0.0;  ///< χ² per row of whitened cells, poses and light integrated out; noise alone: 1
  /// Correlation of what is left between neighbouring cells; noise alone: 0.
  double neighbour_correlation = 0.0;
};

/// One capture, before and after.
struct JudgedCapture {
  std::string name{}, block{};
  double before_mm = 0.0, after_mm = 0.0;  ///< mean error
  double rms_before_mm = 0.0, rms_after_mm = 0.0;
  double since_power_on_s = 0.0, distance_m = 0.0;
};

/// A camera model without noise, and what its device's offset and gain are.
struct JudgedModel {
  std::vector<sim::AnyEffect> effects{};
  double offset_mm = 0.0, gain_percent = 0.0;
  /// The share of the open captures' noise that went into its numbers: of a pattern, one for each pixel.
  double fitted_share = 0.0;
};

/// The camera file as it is, with where zero lies, and with all that was found.
struct JudgedModels {
  JudgedModel before{}, with_zero{}, after{};
};

struct Judgement {
  /// As declared without and with where zero lies: an offset, then the light's delay, too; and with all that was found.
  RangeErrors raw{}, before{}, with_zero{}, after{};
  std::vector<JudgedCapture> captures{};
  std::vector<JudgedRegion> regions{};
  MeanErrors mean{};
  /// The share of what can be explained that where zero lies removes: of χ²_before over noise what χ²_zero is
  /// less by.
  double removed_by_zero = 0.0;
  /// What was found removes of the rest, χ²_zero over noise, what is left taken as not negative; and the 95 %
  /// of it that noise in these captures allows.
  double removed = 0.0, removed_low = 0.0, removed_high = 0.0;
  double explainable = 0.0;  ///< χ²_zero − noise
  int cells = 0;             ///< of each capture, at most, in these χ²
  double noise = 1.0;        ///< χ² of noise per row, as the open captures say
  /// χ²_before − χ²_after in the finest cells. Noise moves this only along what was found, not by all rows': in larger
  /// cells it would be no surer, and blind to what each pixel has by itself.
  double gained = 0.0;
};

}  // namespace toftwin::discover
