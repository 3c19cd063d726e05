// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include <toftwin/geometry.h>

/// With nothing hidden, the simulator with the device's datasheet must see what the device sees; else what a
/// finder finds is a disagreement of two models.
namespace toftwin::reference {

/// How two free-of-noise pictures of the same thing differ, over pixels valid in both.
struct Agreement {
  std::size_t pixels = 0, edges = 0;
  double mean_mm = 0.0, rms_mm = 0.0, worst_mm = 0.0;  ///< simulator less device, in range, edges aside
  double mean_gain = 0.0, rms_gain = 0.0;              ///< likewise, logarithm of the amplitude
  double edge_mean_mm = 0.0, edge_rms_mm = 0.0;        ///< over pixels within one of an edge
  double noise_mm = 0.0;  ///< of a pixel in the mean of 8 frames, root mean square
};

struct AgreementJob {
  std::filesystem::path camera, scene;
  Transform<World, Camera> world_from_camera{};
  double exposure_scale = 1.0;
  int first_column = 0, columns = 0;  ///< only these are traced; 0: all
  int samples_per_pixel = 1024, max_surfaces = 32;
  std::uint64_t seed = 1;
};

/// Throws std::runtime_error where a file is wrong.
Agreement agreementOf(const AgreementJob& job);

}  // namespace toftwin::reference
