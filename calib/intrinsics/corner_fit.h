// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include <toftwin/image.h>

#include "calib/intrinsics/target.h"

namespace toftwin::intrinsics {

/// Where a corner of four squares is about, and how its neighbours lie; or the outer corner of one dark
/// square.
struct CornerGuess {
  Pixel at{};
  std::array<double, 2> along{};   ///< from here to the next corner in the row, pixels
  std::array<double, 2> across{};  ///< to the next corner in the column
  double reach = 0.55;             ///< of a square: how far around nothing but the four squares is seen
  bool is_outer = false;           ///< of one dark square between `along` and `across`, all else bright
};

struct FittedCorner {
  Pixel at{};
  double error_px = 0.0;  ///< standard error of `at`, either direction, from what the fit leaves
  double blur_px = 0.0;   ///< standard deviation of the edges' blur
  double contrast = 0.0;  ///< half of bright minus dark; negative: the first quadrant is dark
};

/// Pixels that a fit takes: two for each of its numbers.
inline constexpr std::size_t kFewestPixels = 22;

/// Fits the meeting of four squares (or the corner of one), blurred, unevenly lit and perhaps cut at
/// `saturation`, to the pixels within half a square around (see the source for the formula). Nothing if that
/// does not converge near the guess.
std::optional<FittedCorner> fitCorner(const Image<float>& image, const CornerGuess& guess,
                                      float saturation);

}  // namespace toftwin::intrinsics
