// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

/// How an O3R's head counts. A count is turned back as the maker's client does it, in float:
///   d = u · r                     distance in metres; u = 0: none
///   a = (u - 1)² · s, u ≥ 1       amplitude; u = 0: none
/// r and s stand in TOF_INFO. [ifm3d 2.0.6, modules/framegrabber]
namespace toftwin::o3r {

inline constexpr float kAmplitudeResolution = 1.552299089269127e-08F;  ///< s of a real head
inline constexpr double kMostCounts = 65'535.0;

/// r, by which the longest range is the most counts. 10 m: 0.15259 mm, as of a real head.
float distanceResolution(double longest_range_m);
/// Rounded; 0 where there is no range, or a longer one.
std::uint16_t distanceCounts(double range_m, float resolution_m);
float metresOf(std::uint16_t counts, float resolution_m);
/// Rounded; at most 65,535; 0 for what is no number.
std::uint16_t amplitudeCounts(double amplitude, float resolution);
/// Negative where there is none.
float amplitudeOf(std::uint16_t counts, float resolution);

}  // namespace toftwin::o3r
