// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <toftwin/result.h>

#include "calib/compare/real_data.h"
#include "calib/compare/scan_line.h"
#include "calib/compare/simulated_line.h"

namespace toftwin::compare {

/// A box before a wall as two scan lines show it: one with the box, one of the wall alone.
struct BoxScene {
  PlanarLine wall;
  double front_z_mm = 0.0;
  double t_left = 0.0, t_right = 0.0;  ///< rays of the box's edges

  [[nodiscard]] double widthMm() const;
  [[nodiscard]] double depthMm() const;
  /// Where the ray t meets the wall, in mm beside the nearer edge of what the box hides; negative
  /// left of it, 0 where the ray meets the box.
  [[nodiscard]] double beside(double t) const;
  /// The scene in the camera's frame; `mirror` swaps left and right.
  [[nodiscard]] Result<sim::Scene> build(bool with_box, bool mirror) const;
};
Result<BoxScene> fitBox(const ScanLine& with_box, const ScanLine& wall_alone);

}  // namespace toftwin::compare
