// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <toftwin/frame.h>

#include "drivers/v4l2/description.h"
#include "drivers/v4l2/pixel_format.h"
#include "drivers/v4l2/stream.h"

namespace toftwin::drivers::v4l2 {

/// Makes a frame's planes from a camera's codes.
class ImageMaker {
 public:
  ImageMaker(const DepthKeys& keys, Lens lens, bool has_infrared);

  /// In the order of the frame. Range only where the lens is known, and so depth of a camera that
  /// measures range.
  [[nodiscard]] std::vector<PlaneKind> kinds() const;
  [[nodiscard]] const CameraInfo& camera() const { return lens_.camera; }
  /// `infrared` may be empty if there is none.
  [[nodiscard]] std::vector<Plane> planes(const Image<std::uint16_t>& depth,
                                          const Image<std::uint16_t>& infrared) const;

 private:
  Measures measures_;
  Lens lens_;
  bool has_infrared_;
  std::vector<float> length_m_;      // of each code, NaN if it has none
  std::vector<std::uint8_t> flags_;  // of each code
  Image<float> depth_per_range_;
};

/// The depth codes of a picture, and those of infrared where the format has both. Empty if bytes
/// are missing.
struct Codes {
  Image<std::uint16_t> depth, infrared;
};
std::optional<Codes> codesOf(const Layout& layout, std::span<const std::byte> bytes);

}  // namespace toftwin::drivers::v4l2
