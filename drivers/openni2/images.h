// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openni2/OniCTypes.h>

#include <cstddef>
#include <span>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/image.h>
#include <toftwin/result.h>

/// OpenNI2's images as planes. Nothing that a device's driver says of an image is believed before
/// it is checked: its bytes come from a plug-in of somebody else, or from a file.
namespace toftwin::drivers::openni2 {

struct RawImage {
  std::span<const std::byte> bytes;
  int width = 0, height = 0;
  int stride = 0;  ///< bytes from one row to the next
  int format = ONI_PIXEL_FORMAT_DEPTH_1_MM;  ///< of OniPixelFormat, or whatever else was said
};

/// As a plain number: a value that is none of the enumeration's must not be read as one.
[[nodiscard]] int formatOf(const OniVideoMode& mode);

[[nodiscard]] bool isDepth(int format);
[[nodiscard]] bool isInfrared(int format);
[[nodiscard]] bool isColor(int format);

struct DepthImages {
  Image<float> range_m, depth_m;
  Image<std::uint8_t> flags;
};
/// Depth along the axis → range by `depth_per_range` (z of the unit rays), whose size the image
/// must have. Zero is no value.
Result<DepthImages> depthImages(const RawImage& raw, const Image<float>& depth_per_range);
/// In the device's unit.
Result<Image<float>> infraredImage(const RawImage& raw, int width, int height);
/// Three channels, one after the other.
Result<Plane> colorPlane(const RawImage& raw, int width, int height);

}  // namespace toftwin::drivers::openni2
