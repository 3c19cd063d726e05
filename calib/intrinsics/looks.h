// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include <toftwin/image.h>

#include "calib/intrinsics/target.h"

/// An image of brightness as a search for corners or markers can read it: 8 bits, stretched and enlarged.
namespace toftwin::intrinsics {

/// How an image is shown to the search: brightness to the power `gamma`, enlarged.
struct Look {
  double gamma;
  int scale;
  bool evened;  ///< contrast evened out locally (CLAHE)
};
// Ordered by how often each finds what those before it did not.
inline constexpr Look kLooks[] = {{1.0, 1, false}, {0.5, 2, false}, {1.0, 2, true}, {0.5, 1, true},
                                  {0.25, 2, true}, {1.0, 3, false}, {0.5, 3, true}, {2.0, 2, false}};
inline constexpr std::size_t kQuickLooks = 2, kSlowLooks = 4;

/// Brightness between which an image's pixels lie, but for a few; black borders are left out.
struct Span {
  float low = 0.0F, high = 1.0F;
};
Span spanOf(const Image<float>& image);

/// Pixels without a value (0 or NaN) among pixels with one get their neighbours' median.
Image<float> mended(const Image<float>& image);

cv::Mat show(const Image<float>& image, const Span& span, const Look& look);

/// Pixel centres of an enlarged copy in the original's coordinates.
std::vector<Pixel> shrunk(const std::vector<cv::Point2f>& points, int scale);

}  // namespace toftwin::intrinsics
