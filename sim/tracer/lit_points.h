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
/// every frame. Light is expected to arrive where no mover's ball is in its way, in part where one is, and not where the
/// ball's core is: one ray to one of the former, picked by its share, says what was expected wrongly. Near a corner a lit point's share grows with 1/r²:
/// by multiple importance sampling it leaves that to directions drawn by the cosine.
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
    const Lanes<int>& mover;  ///< CoarseGrid::mover
  };
  /// What share of each point's radiance counts, beside so many directions drawn by the cosine:
  ///     g / (q + n g)    with g = cos θ cos θ' / (π r²) and q the density of lit points, per m²
  struct Shares {
    std::vector<Lanes<float>> share;
    std::vector<Lanes<float>> way;
    std::vector<Lanes<float>> open;  ///< what is expected to arrive: part where a mover's ball is in the way, 0 where its core
    std::vector<std::size_t> lighting;  ///< those that light any of the receivers
    Lanes<float> total;                 ///< of steady radiance that is expected to arrive
    Lanes<float> clear;   ///< of the steady radiance of points that nothing is expected to hide
    Lanes<float> behind;  ///< of that of those that are expected to arrive in part, whether they do or not
  };
  /// Sixteen lit points, one for each point of a tile.
  struct Place {
    Vec3fLanes position, normal;
    Lanes<float> density;                ///< of points per m², as one receiver has them
    std::vector<Lanes<float>> radiance;  ///< by channel
    Lanes<int> mover;                    ///< CoarseGrid::mover
  };
  /// A moving object, as what is between points and receivers is expected to be hidden by it.
  struct Ball {
    float x, y, z, radius;
    float core;  ///< radius within which nothing goes through
    float open;  ///< share of what goes through the rest of it
    int mover;
  };
  void weigh(const Receivers& receivers, int directions, Shares& shares) const;
  /// Adds the light.
  void add(const Tracing& tracing, const Channels& channels, const Shares& shares, LaneSums& sums) const;
  /// One of them for each receiver, which stands for all of its kind.
  struct Pick {
    Lanes<int> point;     ///< −1: there is no light
    Lanes<float> steady;  ///< radiance of all that it stands for
  };
  /// Of so many picks one has `is_other`.
  static constexpr std::uint32_t kTurns = 4;
  /// Picks by shares of the total, from numbers in [0, 1), among those that nothing is expected to be in the way of, or
  /// those that are expected to arrive in part where `is_other`. Where there are both, each pick stands for as many
  /// samples as there are turns for one of its kind; where there is one, that is picked.
  void pick(const Shares& shares, const Lanes<float>& draws, const Lanes<int>& is_other, Pick& pick) const;
  void placesOf(const Pick& pick, Vec3Lanes& places) const;
  /// Makes up for what was expected wrongly, by whether the picked ones are blocked. `room` is for a number of each
  /// channel.
  void mend(const Tracing& tracing, const Channels& channels, const Shares& shares, const Pick& pick,
            const Lanes<int>& is_blocked, std::vector<Lanes<float>>& room, LaneSums& sums) const;

  /// The share n g / (q + n g) that is left to one of `directions` drawn by the cosine, for the light of emitter
  /// `e` on hits that such directions have met, seen from surfaces with these normals.
  void leave(const PlacedEmitter& emitter, const Packet& packet, const Vec3Lanes& normals, const Hits& hits,
             int directions, Lanes<float>& weight) const;

 private:
  void takeBalls(const Tracing& tracing);
  static void takeOf(const Tracing& tracing, const Channels& channels, const PlacedEmitter& emitter, Packet& packet,
                     Place& place);

  std::vector<Place> places_;
  std::vector<Ball> balls_;
};

}  // namespace toftwin::sim
