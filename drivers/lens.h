// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include <toftwin/camera_info.h>
#include <toftwin/image.h>
#include <toftwin/result.h>
#include <toftwin/units.h>

#include "protocol/settings/settings.h"

/// What is known of a lens where the camera does not say it: written by a person.
namespace toftwin::drivers {

struct LensKeys {
  int width = 0;
  int height = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;
  std::array<double, 5> distortion{};
  Angle field_of_view = 0_deg;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("width", width, {0, 16384},
             "pixels per row that the numbers below are for; 0: those of the depth image");
    v.number("height", height, {0, 16384}, "likewise, rows");
    v.number("fx", fx, {0, 1e6}, "focal length in pixels; 0: not known");
    v.number("fy", fy, {0, 1e6}, "likewise, vertical; 0: as fx");
    v.number("cx", cx, {0, 16384}, "principal point; (0, 0) is the centre of the first pixel");
    v.number("cy", cy, {0, 16384}, "likewise");
    v.numbers("distortion", distortion, {-100, 100}, "k1 k2 p1 p2 k3");
    v.quantity("field_of_view", field_of_view, degree, {0, 179},
               "horizontal, for a lens without distortion if fx is 0; 0: not known");
  }
};

/// With the field of view, if that is what is known, turned into fx, fy, cx and cy at width and height; as it
/// is without these. For whoever cuts an image: only what is in pixels can be cut.
LensKeys inPixels(const LensKeys& keys);

/// The lens for an image of that size, if its numbers are known.
struct Lens {
  CameraInfo camera;
  bool is_known = false;  ///< if not, a field of view of 60 degrees stands in
};
/// `driver` names it in errors and makes its calibration ids different from those of others.
Result<Lens> lensFor(const LensKeys& keys, int width, int height, std::string_view driver);

/// What the key `calibration` of a source is for.
inline constexpr const char* kCalibrationHelp =
    "a file of `toftwin calibrate`, relative to this one: the lens, instead of what is known of it otherwise; its id is "
    "in every frame";
/// The lens of that file. Nothing if `file` is empty, or after complaining about the key `calibration`.
std::optional<CameraInfo> calibrationAt(settings::Table& table, const std::string& file);
/// A calibrated lens for an image of that size, scaled if it is of another size and the same shape. Its id stays that of
/// the calibration, or becomes that of the scaled lens.
Result<Lens> lensFor(const CameraInfo& calibrated, int width, int height, std::string_view driver);

/// The z of each pixel's unit ray: depth per range.
Image<float> depthPerRange(const CameraInfo& camera);

}  // namespace toftwin::drivers
