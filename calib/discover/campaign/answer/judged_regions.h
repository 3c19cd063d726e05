// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <toftwin/image.h>

/// Before and after, by where pixels are and what they see.
namespace toftwin::discover {

/// A pixel of a locked capture that both models have a range for; errors are measured − simulated.
struct JudgedPixel {
  float before_mm = 0.0F, after_mm = 0.0F;
  float range_m = 0.0F;        ///< as simulated before
  float log_amplitude = 0.0F;  ///< as measured; NaN: the camera tells none
  float variance_mm2 = 0.0F;   ///< of the mean over frames
  float radius = 0.0F;         ///< from the middle of the image, of half its diagonal
  bool is_edge = false;        ///< where depth jumps
};

/// One row of a table: some pixels of all locked captures together.
struct JudgedRegion {
  std::string name{};
  std::size_t pixels = 0;
  double bias_before_mm = 0.0, bias_after_mm = 0.0;
  double rms_before_mm = 0.0, rms_after_mm = 0.0;
  double p95_before_mm = 0.0, p95_after_mm = 0.0;
  double noise_mm = 0.0;  ///< of the means over frames, root of the mean square: what no model takes off
};

/// Surfaces and edges; then of the surfaces, each where there are any: the image's middle, what is around it and its
/// corners; ranges, as `toftwin compare` has them; thirds of the amplitude.
std::vector<JudgedRegion> regionsOf(const std::vector<JudgedPixel>& pixels);

/// Means over captures of each pixel's error, NaN where there is none.
struct MeanErrors {
  Image<float> before_mm{}, after_mm{};
};

}  // namespace toftwin::discover
