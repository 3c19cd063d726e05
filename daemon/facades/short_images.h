// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <toftwin/frame.h>

namespace toftwin::daemon {

/// Frames as images of 16 bits per pixel, little-endian: what Linux calls Z16 and Y16.
class ShortImages {
 public:
  struct Scale {
    double depth_unit_mm = 1.0;
    double amplitude_per_count = 1.0;
  };
  explicit ShortImages(Scale scale) : scale_(scale) {}

  /// round(1000 · depth / depth_unit_mm), halves away from zero; 0 where invalid or beyond 65,535. A frame
  /// that has range alone: depth = range · z of the pixel's ray. Nothing if it has neither.
  std::optional<std::vector<std::byte>> depthOf(const Frame& frame);
  /// round(amplitude / amplitude_per_count), at most 65,535; 0 where it is not known. Nothing if it has none.
  [[nodiscard]] std::optional<std::vector<std::byte>> amplitudeOf(const Frame& frame) const;

 private:
  struct Rays {
    CameraInfo camera;
    std::vector<float> unit_vectors;
  };
  const Scale scale_;
  std::optional<Rays> rays_;  ///< of the last frame that needed them
};

}  // namespace toftwin::daemon
