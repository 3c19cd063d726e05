// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openni2/OniCTypes.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <toftwin/frame.h>

#include "daemon/facades/openni2/keys.h"

namespace toftwin::openni2 {

/// The part of an image that is given, in pixels of the image as it is given (mirrored or not).
struct Window {
  int x = 0, y = 0, width = 0, height = 0;
};

struct ImageSetup {
  OniVideoMode mode{};
  Window window;
  bool is_mirrored = false;
  Length max_depth = 10_m;
  double amplitude_per_count = 1.0;
};

/// The z of each pixel's unit ray, row by row: depth = range · z.
std::vector<double> depthPerRange(const CameraInfo& camera);

/// The least code that depth does not reach: 0 and what is nearer than it are the codes.
int maxDepthCode(OniPixelFormat format, Length max_depth);

/// Writes the frame's image in the mode's format, without gaps between rows. `depth_per_range` is of the whole
/// image, and only read if the frame has range but no depth. Returns the bytes written; 0 if the frame lacks that
/// image in the mode's size, or `out` is too small.
std::size_t draw(const Frame& frame, const std::vector<double>& depth_per_range, const ImageSetup& setup,
                 std::span<std::byte> out);

/// Device time of the first exposure in whole microseconds, rounded down; when the daemon had the frame, if no
/// exposure is known.
std::uint64_t stampOf(const Frame& frame);

}  // namespace toftwin::openni2
