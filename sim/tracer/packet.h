// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sim/tracer/random.h"

namespace toftwin::sim {

/// Sixteen paths on their way; lane i of each member belongs to path i.
struct Packet {
  Lanes<int> valid;          ///< −1 while the path goes on
  Vec3Lanes origin;          ///< exact: the pinhole or a place on a surface
  Vec3fLanes start;          ///< what Embree gets as origin
  Vec3Lanes direction;       ///< unit
  Lanes<double> length;      ///< from the pinhole to `origin`
  Lanes<float> throughput;
  Lanes<std::uint32_t> key_a, key_b;  ///< of the pixel's random numbers
  Lanes<std::uint32_t> index;         ///< of the sample
  bool is_even = true;                ///< whether random numbers are spread evenly over the samples

  [[nodiscard]] PixelKey key(std::size_t lane) const { return {key_a[lane], key_b[lane]}; }
};

/// Where sixteen paths met the scene.
struct Hits {
  Vec3Lanes normal;    ///< geometric, unit, on the side that the ray comes from
  Lanes<double> distance;
  Vec3Lanes position;  ///< on the surface
  Vec3fLanes start;    ///< of rays that leave on the normal's side
  Lanes<float> albedo, emission, shape_a, shape_b;  ///< Material
};

/// What one packet of paths brought back, per lane.
struct LaneSums {
  explicit LaneSums(std::size_t terms) : re(terms), im(terms) {}
  Lanes<float> steady{}, ambient{};
  std::vector<Lanes<float>> re, im;  ///< [frequency][harmonic]
  std::vector<Lanes<double>> bins;   ///< by path length, if the light is wanted so (transient.h); kept between packets
};

inline bool isAny(const Lanes<int>& valid) {
  int any = 0;
  for (std::size_t i = 0; i < kLaneCount; ++i) any |= valid[i];
  return any != 0;
}

}  // namespace toftwin::sim
