// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <toftwin/frame.h>

namespace toftwin::daemon::o3d303 {

/// The pixels that an automatic exposure looks at, the last ones among them.
struct ExposureRegion {
  int left = 0, top = 0, right = 1 << 16, bottom = 1 << 16;
  /// Around one pixel, nine of them.
  static ExposureRegion around(int x, int y);
  bool operator==(const ExposureRegion&) const = default;
};

/// What the parameter AutoExposureReferenceROI says: JSON with "ROIs", of which the first counts, by its
/// center_x, center_y, width and height. Nothing if it is none; any text is safe.
std::optional<ExposureRegion> readExposureRegion(const std::string& json);

/// Share of the region's pixels that the longest exposure saturated. Nothing where the frame does not tell.
std::optional<double> saturatedShareOf(const Frame& frame, const ExposureRegion& region);

/// Finds the exposure time at which the region is as bright as it can be without saturating: it grows by a
/// quarter a frame while nearly no pixel saturates, shrinks by a fifth while more than one in a hundred does,
/// and grows slowly after that, so that it does not swing. The camera's own rule is not public.
class AutoExposure {
 public:
  struct Bounds {
    double least_us = 1.0, most_us = 10'000.0;
  };
  /// The exposure time to be set, in whole microseconds; nothing if it may stay. `now_us`: that of the frame.
  std::optional<double> next(double now_us, double saturated_share, Bounds bounds);

 private:
  bool has_met_saturation_ = false;
};

}  // namespace toftwin::daemon::o3d303
