// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sim/tracer/indirect.h"

namespace toftwin::sim {

/// Points that the emitters light, as sources of light over two surfaces: rays leave each emitter evenly over all
/// directions that it shines into, and what they meet sends its light on to every coarse point.
///
/// Each of the sixteen points of a tile has 64 lit points of its own, evenly spread by themselves; others in
/// every frame. Light falls in whatever is in its way: one ray to one of them, picked by its share, says how much
/// is to be taken off. Near a corner a lit point's share grows with 1/r²: by multiple importance sampling it
/// leaves that to directions drawn by the cosine.
class LitPoints {
 public:
  /// Those of a frame, which `frame` draws.
  void take(const Tracing& tracing, const Channels& channels, std::uint32_t frame);
  void clear() { places_.clear(); }
  [[nodiscard]] bool areAny() const { return !places_.empty(); }

  /// The coarse points of a tile.
  struct Receivers {
    Vec3fLanes position, normal;
    const Lanes<int>& valid;
  };
  /// What share of each point's radiance counts, beside so many directions drawn by the cosine:
  ///     g / (q + n g)    with g = cos θ cos θ' / (π r²) and q the density of lit points, per m²
  struct Shares {
    std::vector<Lanes<float>> share;
    std::vector<Lanes<float>> way;
    std::vector<std::size_t> lighting;  ///< those that light any of the receivers
    Lanes<float> total;                 ///< of steady radiance
  };
  void weigh(const Receivers& receivers, int directions, Shares& shares) const;
  /// Adds the light.
  void add(const Tracing& tracing, const Channels& channels, const Shares& shares, LaneSums& sums) const;
  /// One of them for each receiver, by its share of the total, from a number in [0, 1); −1: there is no light.
  void pick(const Shares& shares, const Lanes<float>& draws, Lanes<int>& picked) const;
  void placesOf(const Lanes<int>& picked, Vec3Lanes& places) const;
  /// Takes that part of all light off where `is_blocked`: the point that was picked stands for it. `room` is
  /// for a number of each channel.
  void takeOff(const Tracing& tracing, const Channels& channels, const Shares& shares, const Lanes<int>& picked,
               const Lanes<int>& is_blocked, float part, std::vector<Lanes<float>>& room, LaneSums& sums) const;

  /// The share n g / (q + n g) that is left to one of `directions` drawn by the cosine, for the light of emitter
  /// `e` on hits that such directions have met, seen from surfaces with these normals.
  void leave(const PlacedEmitter& emitter, const Packet& packet, const Vec3Lanes& normals, const Hits& hits,
             int directions, Lanes<float>& weight) const;

 private:
  struct Place {
    Vec3fLanes position, normal;
    Lanes<float> density;                ///< of points per m², as one receiver has them
    std::vector<Lanes<float>> radiance;  ///< by channel
  };
  static void takeOf(const Tracing& tracing, const Channels& channels, const PlacedEmitter& emitter, Packet& packet,
                     Place& place);

  std::vector<Place> places_;
};

}  // namespace toftwin::sim
