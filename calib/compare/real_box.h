// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include <toftwin/result.h>

#include "calib/compare/real_data.h"
#include "calib/compare/scan_line.h"
#include "calib/compare/simulated_line.h"

namespace toftwin::compare {

/// What a scan line does not show of the scene. Defaults: the real box.
struct BoxMaterials {
  double wall_albedo = 0.8, box_albedo = 0.5;
  double sigma_deg = 0.0;  ///< Oren–Nayar roughness of both
  double wall_size_mm = 2000.0, wall_height_mm = 1200.0;
  double box_height_mm = 150.0, box_below_axis_mm = 0.0;  ///< its middle below the optical axis
};

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
  /// Where the ray t meets the wall, or would if the box were not there: x in mm.
  [[nodiscard]] double placeOnWall(double t) const;
  /// The scene in the camera's frame; `mirror` swaps left and right.
  [[nodiscard]] Result<sim::Scene> build(bool with_box, const BoxMaterials& materials = {},
                                         bool mirror = false) const;
};
Result<BoxScene> fitBox(const ScanLine& with_box, const ScanLine& wall_alone);

/// The change that a box makes in the published simulator, with − without along the ray, moved to
/// another line of a box of nearly the same geometry: on the wall by the distance beside the box,
/// on the box by the share of its width.
struct PublishedBox {
  BoxScene box;              ///< its own geometry
  std::vector<double> x_mm;  ///< of its rays, moved to the other line's places on the wall
  std::vector<double> change_mm;
  /// The change at a place on the other line's wall, linear between rays; NaN outside of them.
  [[nodiscard]] double changeAt(double x_mm) const;
};
Result<PublishedBox> loadPublishedBox(const std::filesystem::path& data_folder,
                                      const BoxScene& other);

}  // namespace toftwin::compare
