// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "sim/images/light.h"
#include "sim/sensor/sensor_model.h"

/// A few pixels around the optical axis before a flat wall square to it, as the tables of distance errors,
/// noise and warm-up were taken.
namespace toftwin::validate {

/// The light of a camera before a wall, 4 m × 4 m, at each of some distances, traced once: for fits that
/// change the camera's effects again and again.
struct TracedWalls {
  std::vector<sim::Light> light;
  std::vector<double> truth_mm;  ///< mean range of the pixels
  int left = 0, top = 0;         ///< of the pixels within the image
};
Result<TracedWalls> traceWalls(const sim::SensorModel& camera, double albedo,
                               const std::vector<double>& distances_mm, std::uint64_t seed);
/// Range of one frame at each of them, in mm, mean over the pixels; NaN where a pixel is invalid. For cameras
/// without noise (withoutNoise).
std::vector<double> readRanges(const sim::SensorModel& camera, const TracedWalls& walls,
                               const Moment& moment = {});

/// Each pixel read so many times, with the camera's noise.
struct WallReading {
  double truth_mm = 0.0;
  double range_mm = 0.0;   ///< mean over pixels and frames
  double sigma_mm = 0.0;   ///< temporal, root mean square over the pixels
  double amplitude = 0.0;  ///< mean, electrons
  double valid_share = 0.0;
};
std::vector<WallReading> readWalls(const sim::SensorModel& camera, const TracedWalls& walls, int frames,
                                   std::uint64_t seed, const std::function<void(double)>& progress = {});

/// Errors (range − truth) at other distances, linear between those of the walls; NaN from the last one on and
/// before the first. Truths ascend.
std::vector<double> errorsAt(const std::vector<double>& reference_mm, const std::vector<double>& truth_mm,
                             const std::vector<double>& range_mm);

}  // namespace toftwin::validate
