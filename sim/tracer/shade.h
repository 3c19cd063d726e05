// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "sim/tracer/emitter.h"
#include "sim/tracer/lanes.h"

namespace toftwin::sim {

/// Sixteen paths on their way; lane i of each member belongs to path i.
struct Packet {
  Lanes<int> valid{};          ///< −1 while the path goes on
  Vec3Lanes origin{};          ///< exact: the pinhole or a place on a surface
  Vec3fLanes start{};          ///< what Embree gets as origin
  Vec3Lanes direction{};       ///< unit
  Lanes<double> length{};      ///< from the pinhole to `origin`
  Lanes<float> throughput{};
  Lanes<std::uint64_t> key{};  ///< of the pixel's random numbers
  Lanes<std::uint32_t> index{};  ///< of the sample
};

/// Where sixteen paths met the scene. Lanes that met nothing hold harmless numbers.
struct Hits {
  // From the scene, lane by lane:
  Vec3Lanes normal;  ///< then turned to the side that the ray comes from
  Lanes<double> level, distance, offset;
  Vec3Lanes onto, inside;
  Lanes<float> albedo, shape_a, shape_b;  ///< Material
  // Computed by placeHits:
  Vec3Lanes position;
  Vec3fLanes start;  ///< of rays that leave on the normal's side
};

/// What one packet of paths brought back, per lane.
struct LaneSums {
  explicit LaneSums(std::size_t terms) : re(terms), im(terms) {}
  void clear() {
    steady = ambient = {};
    std::fill(re.begin(), re.end(), Lanes<float>{});
    std::fill(im.begin(), im.end(), Lanes<float>{});
  }
  Lanes<float> steady{}, ambient{};
  std::vector<Lanes<float>> re, im;  ///< [frequency][harmonic]
};

/// Positions, normals on the ray's side, and starts of the rays that leave.
void placeHits(const Packet& packet, Hits& hits);

/// Light from places on one emitter straight to the hits, before anything is in its way.
struct DirectLight {
  Lanes<int> valid;      ///< −1 where there is any
  Lanes<float> weight;   ///< throughput · albedo/π · shape · cos θ · I(γ) / d²
  Lanes<double> length;  ///< of the whole path
};
void lightHits(const Packet& packet, const Hits& hits, const PlacedEmitter& emitter, const Vec3Lanes& places,
               DirectLight& light);
/// Rays from the hits to the places.
void setShadowRays(const Hits& hits, const Vec3Lanes& places, RTCRay16& rays);

/// Sends the paths on from their hits: cosine-weighted, so that a Lambertian surface costs its albedo.
/// Even: the directions of a pixel's samples are spread evenly (random.h).
void bounce(const Hits& hits, std::uint64_t dimension, bool is_even, Packet& packet);

/// Rays of the packet as Embree takes them.
void setRays(const Packet& packet, RTCRayHit16& rays);

/// Adds w · exp(−i 2π n f L/c) for every frequency and harmonic, lane by lane.
void addPhasors(const std::vector<double>& turns_per_metre, int harmonics, const Lanes<float>& weight,
                const Lanes<double>& length, LaneSums& sums);

}  // namespace toftwin::sim
