// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <toftwin/geometry.h>
#include <toftwin/image.h>
#include <toftwin/result.h>

#include "calib/compare/gross.h"
#include "calib/compare/stack.h"

namespace toftwin::compare {

/// Two stacks of one pose, pixel by pixel in camera A's image. Differences are B − A.
struct PoseComparison {
  Image<float> range_a_mm;     ///< mean range of A
  Image<float> difference_mm;  ///< of the mean ranges; NaN where not both are valid
  Image<float> noise_a_mm, noise_b_mm;
  Image<float> valid_a, valid_b;  ///< share of frames; NaN where B does not look
  Image<float> amplitude_a;       ///< empty if A gives none
  Image<float> amplitude_ratio;   ///< B / A; empty unless both give amplitude
  Image<std::uint8_t> edge;       ///< 1 within two pixels of a jump in A's range
  Image<std::uint8_t> flying_a, flying_b;  ///< B's along A's rays
  /// What lies over kGross_mm from here is gross: middleOfCut_mm() of what both have.
  double middle_mm = 0.0;
  bool resampled = false;         ///< B had another camera model and was interpolated
  double shared_rays = 1.0;       ///< of A's rays the share that B looks along, too
  CameraInfo camera{};            ///< of these images: A's
  /// Where the cameras stood; nothing if neither says it.
  std::optional<Transform<World, Camera>> pose;
};

/// Error where they cannot be compared: known poses that differ, or fields of view that share less
/// than one pixel in a hundred.
Result<PoseComparison> comparePose(const Stack& a, const Stack& b);

/// That B was interpolated to A's rays, and how many of them it has; empty where both have the same camera
/// model.
std::string resamplingNote(const PoseComparison& pose);

/// Pixels beside which the range jumps by more than `jump` of itself between neighbours, and by more than
/// noise may make it, widened by `radius`: 1. Invalid pixels are no jump. `noise`: σ of each range; empty or
/// NaN: not known.
Image<std::uint8_t> edgesOf(const Image<float>& range, const Image<float>& noise = {}, double jump = 0.03,
                            int radius = 2);
/// σ of each pixel's mean over so many frames: of the temporal noise of all pixels around it, as its own of a
/// few frames is not known well enough. NaN for a single frame.
Image<float> noiseOfMean(const Image<float>& temporal_noise, std::size_t frames);

/// Valid pixels that hang between a near and a far surface: in the row or the column, the ranges
/// two pixels to either side differ by more than `jump` of themselves and the pixel lies more than
/// 15 % of that gap away from both, or beyond them by that much. The surfaces must not climb
/// themselves.
Image<std::uint8_t> flyingPixelsOf(const Image<float>& range, double jump = 0.03);

/// The one rule of which pixels are compared: valid in at least half of the frames of either camera,
/// and not gross. Where B was interpolated the difference can be unknown all the same, beside a jump.
bool isCompared(const PoseComparison& pose, std::size_t pixel);

/// B − A of the compared pixels, NaN elsewhere.
Image<float> comparedDifference_mm(const PoseComparison& pose);

}  // namespace toftwin::compare
