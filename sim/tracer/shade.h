// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sim/tracer/emitter.h"
#include "sim/tracer/packet.h"

namespace toftwin::sim {

/// std::max goes through references, which keeps loops from becoming vector code.
TOFTWIN_INLINE double larger(double a, double b) { return a > b ? a : b; }

/// Reflection relative to a Lambertian surface (material.h): A + B · max(0, cos Δφ) sin α tan β, from
/// the cosine between both directions and their cosines to the normal. sin α sin β cos Δφ is what the
/// first has more than the product of the others, and tan β divides by the larger cosine.
TOFTWIN_INLINE float shapeOf(float a, float b, double between, double cosine, double other) {
  const auto sines = static_cast<float>(larger(0.0, between - cosine * other));
  return a + b * sines / static_cast<float>(larger(larger(cosine, other), 1e-9));
}

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

/// Places on an emitter, drawn for each path.
void drawPlaces(const Packet& packet, const PlacedEmitter& emitter, std::uint32_t dimension, Vec3Lanes& places);

/// Sends the paths on from their hits: cosine-weighted, so that a Lambertian surface costs its albedo.
/// Even: the directions of a pixel's samples are spread evenly (random.h).
void bounce(const Hits& hits, std::uint32_t dimension, bool is_even, Packet& packet);

/// A path below `threshold` survives by chance, with that throughput.
void playRoulette(std::uint32_t dimension, float threshold, Packet& packet);

/// Rays of the packet as Embree takes them.
void setRays(const Packet& packet, RTCRayHit16& rays);

/// Adds w · exp(−i 2π n f L/c) for every frequency and every harmonic of `orders` up to its last one, lane by lane.
void addPhasors(const std::vector<double>& turns_per_metre, const std::vector<int>& orders,
                const std::vector<int>& last_orders, const Lanes<float>& weight,
                const Lanes<double>& length, LaneSums& sums);

/// Adds w · g(L) of both functions, lane by lane.
void addGates(const PathFunctions& gates, const Lanes<float>& weight, const Lanes<double>& length, Lanes<float>& first,
              Lanes<float>& second);

}  // namespace toftwin::sim
