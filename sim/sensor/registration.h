// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include <toftwin/camera_info.h>
#include <toftwin/geometry.h>
#include <toftwin/image.h>

#include "sim/decode/decode.h"

namespace toftwin::sim {

/// The frame of the colour lens: x right, y down, z along its axis.
struct ColorLens {};

/// Red, green and blue, 0 to 255 as screens show them (sRGB).
using ColorImage = std::array<Image<std::uint8_t>, 3>;

/// How depth and colour lens see each other.
struct LensPair {
  CameraInfo depth, color;
  Transform<ColorLens, Camera> color_from_camera;
};

/// The depth image as the colour lens would see it: metres along the colour lens's axis in its
/// pixels, NaN where nothing is known. Neighbouring depth pixels are one surface unless they are a
/// jump apart (5 % of their depth); what is nearer hides what is behind.
Image<float> depthInColor(const LensPair& lenses, const DecodeRays& rays,
                          const Image<float>& range_m);

/// What the colour lens sees at each depth pixel; black where that pixel is invalid, outside the
/// colour image, or hidden from the colour lens: farther than 2 % behind what depthInColor() shows
/// around it.
ColorImage colorInDepth(const LensPair& lenses, const DecodeRays& rays, const Image<float>& range_m,
                        const Image<float>& depth_in_color_m, const ColorImage& color);

}  // namespace toftwin::sim
