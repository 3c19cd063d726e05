// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// The calibration that the device stores, the camera file's lens, is not quite the lens it has. A pixel
/// at (x, y) from the principal point, in focal lengths, really looks along
///     (x', y') = (x, y) · (1 + k r²) / (1 + ε) + (s_x / f_x, s_y / f_y),   r² = x² + y²
/// and gets that place's light, interpolated between four pixels. Ranges are right, for another ray:
/// depth and points are wrong, the more the farther off the axis.
struct DistortionMisfit {
  double focal_error = 0.005;
  double radial = 0.0;
  double right = 0.0, down = 0.0;  ///< s, pixels

  static constexpr About about{
      .name = "distortion_misfit",
      .summary = "the lens is not what the device's calibration says: right ranges along wrong rays",
      .reference = "the camera model of OpenCV's calib3d, its focal length and first radial term",
      .explains = {Covariate::Amplitude, Covariate::Range, Covariate::Position, Covariate::Neighbours}};
  static DistortionMisfit none() { return {.focal_error = 0.0}; }

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("focal_error", focal_error, {-0.5, 0.5},
             "epsilon: the true focal length is longer by this share");
    v.number("radial", radial, {-10.0, 10.0}, "k, of the true lens beyond the stored one");
    v.number("right_px", right, {-1000.0, 1000.0},
             "how far to the right of where it should a pixel looks");
    v.number("down_px", down, {-1000.0, 1000.0}, "the same, downwards");
  }
  [[nodiscard]] Light apply(Light light, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
