// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/image.h>
#include <toftwin/result.h>

#include "drivers/aravis/pixel_format.h"
#include "drivers/lens.h"

/// A camera's buffers as planes. Nothing that a buffer says of itself is believed before it is
/// checked: it comes from the network.
namespace toftwin::drivers::aravis {

/// One image of a buffer, as it describes itself.
struct Part {
  std::span<const std::byte> bytes;
  std::int64_t width = 0, height = 0;
  std::int64_t row_padding = 0;  ///< bytes after each row
  std::uint32_t format = 0;
  std::uint32_t component = 0;  ///< GenICam's ComponentIDValue
  bool is_range = false;        ///< the buffer says that it is a range image, whatever its format
};

/// How a camera's coordinates become lengths (GenICam SFNC, category 3D scan control).
///   coordinate [m] = (scale · code + offset) · unit_m
struct Scan3d {
  struct Axis {
    double scale = 1.0, offset = 0.0;
    std::optional<double> invalid{};  ///< the code that says: no value
  };
  std::array<Axis, 3> axes;  ///< A, B, C
  double unit_m = 1e-3;
  bool c_is_range = false;  ///< a single C is along the pixel's ray, not along the optical axis
};

/// What a camera's frames have, decided when it is opened.
struct Layout {
  bool has_range = false, has_intensity = false, has_confidence = false;
  bool has_points = false;  ///< the range image has A, B and C
  double least_confidence = 1.0;
};

class ImageMaker {
 public:
  ImageMaker(Layout layout, Scan3d scan, Lens lens);

  /// In the order of the frame. From a single C both range and depth only where the lens is known.
  [[nodiscard]] std::vector<PlaneKind> kinds() const;
  [[nodiscard]] const CameraInfo& camera() const { return lens_.camera; }
  /// Malformed if an image is missing, or is not of the camera's size, or its bytes are.
  [[nodiscard]] Result<std::vector<Plane>> planes(std::span<const Part> parts) const;

 private:
  struct Distances;
  [[nodiscard]] Distances distancesOf(const Part& part, const PixelFormat& format) const;
  [[nodiscard]] Result<> check(const Part& part, const PixelFormat& format) const;
  [[nodiscard]] bool isAnnounced(PlaneKind kind) const;

  Layout layout_;
  Scan3d scan_;
  Lens lens_;
  Image<float> depth_per_range_;
};

/// Where the pixels of a frame with A, B and C look, three numbers per pixel, zero where it has no
/// value: for fitCamera().
Result<std::vector<float>> raysOf(const Part& part, const Scan3d& scan);

/// The part for that role: the first of its format; of several intensities that of the component
/// Intensity (1), Reflectance (5) or Infrared (2).
const Part* partFor(Role role, std::span<const Part> parts);

}  // namespace toftwin::drivers::aravis
