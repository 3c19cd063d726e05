// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/image.h>

#include "calib/intrinsics/target.h"
#include "calib/intrinsics/corner_fit.h"

namespace toftwin::intrinsics {

/// Why a view does not count. docs/calibrate.md says what to do about each.
enum class Rejection {
  None,
  NotFound,
  CornerOutliers,
  Blurred,
  TooOblique,
  TooSmall,
  SameImage,
  LikeAnother,
  ReprojectionOutlier
};
inline constexpr std::array kRejections{Rejection::NotFound,    Rejection::CornerOutliers,
                                        Rejection::Blurred,     Rejection::TooOblique,
                                        Rejection::TooSmall,    Rejection::SameImage,
                                        Rejection::LikeAnother, Rejection::ReprojectionOutlier};
std::string_view nameOf(Rejection reason);

/// One corner of the board where it was seen.
struct Corner {
  std::size_t index = 0;  ///< on the board
  Pixel at{};
  double error_px = 0.0;  ///< that the fit to the pixels states
};

/// The board in one image, or why it is of no use.
struct Sighting {
  std::string name{};           ///< of the image
  std::vector<Corner> corners{};
  double blur_px = 0.0;         ///< median over the corners
  double square_px = 0.0;       ///< the least side of a square (or a tag), over the image of the board
  double tilt_deg = 0.0;        ///< of the board against the image, about; from its outline
  Rejection rejection = Rejection::None;
  std::string detail{};         ///< of the rejection: the number that decided
  bool has_more = false;        ///< squares go on beyond the corners: of a board with more than were told

  [[nodiscard]] bool isUsed() const { return rejection == Rejection::None; }
};

struct DetectOptions {
  double most_blur = 0.30;          ///< of the least side of a square, or of a tag's cell
  double most_lost = 0.25;          ///< share of corners
  double least_square_px = 4.0;
  double least_cell_px =
      2.5;  ///< of a tag: smaller ones leave too few pixels between its corner and its cells
  double least_marker_cell_px = 2.0;  ///< of a ChArUco board's markers: smaller ones are not all read
  std::size_t fewest_corners = 12;  ///< of a board with markers, which need not be seen whole
  double most_tilt_deg = 75.0;
  bool is_thorough = true;  ///< false: fewer copies are searched, for live images
};

/// Finds the board in an image of brightness, however dim: several stretched, enlarged copies are
/// searched, then each corner is fitted to the image as it is.
Sighting findBoard(const Image<float>& image, const Target& target, const DetectOptions& options = {});

/// The value at which an image was cut, if a notable share of its pixels has the largest one.
std::optional<float> saturationOf(const Image<float>& image);

}  // namespace toftwin::intrinsics
