// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/lit_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "sim/images/rows.h"
#include "sim/tracer/hit.h"
#include "sim/tracer/phasor.h"
#include "sim/tracer/shade.h"

namespace toftwin::sim {
namespace {

/// So many of each emitter for one receiver: of 8 × 8 cells of the square that directions are drawn from, Sobol's
/// sequence has one in each.
constexpr std::uint32_t kCells = 8, kPoints = kCells * kCells;
/// Movers are expected to be in the way that hide at least so much of what goes through the balls around them: the so
/// many largest.
constexpr double kLeastHidden = 0.05;
constexpr std::size_t kMostBalls = 4;
constexpr std::uint32_t kLeaving = 0x20000;  // random dimension, beyond those of paths
/// A column of pixels that no image has, for random numbers that belong to none.
constexpr std::uint32_t kNoPixel = 0xfffffff0u;

/// The cosine that an emitter's directions begin at, and their density per sr.
double leastCosine(const PlacedEmitter& emitter) {
  if (emitter.is_isotropic) return -1.0;
  const double limit = emitter.pattern.empty() ? emitter.cos_limit : std::cos(emitter.pattern_limit);
  return std::clamp(limit, 0.0, 0.999999);
}
double perSteradian(const PlacedEmitter& emitter) {
  return 1.0 / (2.0 * std::numbers::pi * (1.0 - leastCosine(emitter)));
}

/// Numbers of cells in Morton's order, in which those that follow each other are mostly next to each other.
std::uint32_t numberOfCell(float u, float v) {
  const auto x = static_cast<std::uint32_t>(u * kCells), y = static_cast<std::uint32_t>(v * kCells);
  std::uint32_t number = 0;
  for (std::uint32_t bit = 0; (1U << bit) < kCells; ++bit)
    number |= (x >> bit & 1U) << (2 * bit) | (y >> bit & 1U) << (2 * bit + 1);
  return number;
}

/// Which of the sequence lie in the cells, for each lane: a pick by shares, evenly drawn, then is evenly spread in
/// space.
std::array<Lanes<std::uint32_t>, kPoints> indicesByCell(PixelKey key) {
  std::array<Lanes<std::uint32_t>, kPoints> indices{};
  for (std::size_t lane = 0; lane < kLaneCount; ++lane) {
    for (std::uint32_t i = 0; i < kPoints; ++i) {
      const std::uint32_t index = static_cast<std::uint32_t>(lane) * kPoints + i;
      const RandomPair draw = randomPair(key, index, kLeaving);
      indices[numberOfCell(draw.u, draw.v)][lane] = index;
    }
  }
  return indices;
}

/// Rays of an emitter, one for each lane.
void leaveEmitter(const PlacedEmitter& emitter, PixelKey key, const Lanes<std::uint32_t>& indices, Packet& packet) {
  const Basis basis = basisAround(emitter.axis);
  const double least = leastCosine(emitter);
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const std::uint32_t index = indices[i];
    const RandomPair draw = randomPair(key, index, kLeaving);
    const double cosine = 1.0 - (1.0 - least) * static_cast<double>(draw.u);
    const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
    const CosSin around = cosSinOfTurns(static_cast<double>(draw.v));
    const Vec3d direction = normalised(basis.x * (sine * static_cast<double>(around.cos)) +
                                       basis.y * (sine * static_cast<double>(around.sin)) + emitter.axis * cosine);
    const RandomPair at_disc = randomPair(key, index, kLeaving + 1);
    const Vec3d from = emitter.is_disc ? emitter.place(static_cast<double>(at_disc.u), static_cast<double>(at_disc.v))
                                       : emitter.position;
    packet.origin.x[i] = from.x;
    packet.origin.y[i] = from.y;
    packet.origin.z[i] = from.z;
    packet.start.x[i] = static_cast<float>(from.x);
    packet.start.y[i] = static_cast<float>(from.y);
    packet.start.z[i] = static_cast<float>(from.z);
    packet.direction.x[i] = direction.x;
    packet.direction.y[i] = direction.y;
    packet.direction.z[i] = direction.z;
    packet.valid[i] = -1;
    packet.throughput[i] = 1.0f;
    packet.length[i] = 0.0;
  }
}

/// How many points per m² a receiver has at a squared distance, where light falls in with this cosine.
TOFTWIN_INLINE double pointsPerArea(double per_steradian, double cosine, double square) {
  return kPoints * per_steradian * cosine / square;
}

}  // namespace

/// The largest movers that hide much of what goes through the balls around them.
void LitPoints::takeBalls(const Tracing& tracing) {
  balls_.clear();
  for (std::size_t m = 0; m < tracing.scene.poses.size(); ++m) {
    const Standing& standing = tracing.scene.poses[m];
    if (standing.hides.all < kLeastHidden) continue;
    const Vec3d c = standing.middle();
    balls_.push_back({static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z),
                      static_cast<float>(standing.radius), static_cast<float>(standing.hides.core),
                      static_cast<float>(1.0 - standing.hides.rim),
                      static_cast<int>(m) + 1});
  }
  std::ranges::stable_sort(balls_, std::ranges::greater{}, &Ball::radius);
  if (balls_.size() > kMostBalls) balls_.resize(kMostBalls);
}

void LitPoints::take(const Tracing& tracing, const Channels& channels, std::uint32_t frame) {
  takeBalls(tracing);
  places_.assign(tracing.emitters.size() * kPoints, Place{});
  for (std::size_t e = 0; e < tracing.emitters.size(); ++e) {
    const PixelKey key = pixelKey(tracing.seed, kNoPixel + static_cast<std::uint32_t>(e), frame);
    const auto indices = indicesByCell(key);
    inParallel(static_cast<int>(kPoints), 8, [&](int first, int last) {
      const FlushDenormals flush;
      for (auto p = static_cast<std::size_t>(first); p < static_cast<std::size_t>(last); ++p) {
        Packet packet;
        leaveEmitter(tracing.emitters[e], key, indices[p], packet);
        takeOf(tracing, channels, tracing.emitters[e], packet, places_[e * kPoints + p]);
      }
    });
  }
}

/// What the rays meet becomes lit places.
void LitPoints::takeOf(const Tracing& tracing, const Channels& channels, const PlacedEmitter& emitter, Packet& packet,
                       Place& place) {
  place.radiance.assign(channels.count(), Lanes<float>{});
  RTCRayHit16 rays;
  Hits hits;
  Lanes<float> unused{};
  intersect(tracing, packet, rays, false);
  endMissed(0.0f, rays, packet, unused);
  findHits(tracing.scene, packet, rays, hits);
  place.position = inSingle(hits.position);
  place.normal = inSingle(hits.normal);
  Lanes<float> radiance{};
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    place.density[i] = 1.0f;
    place.mover[i] = 0;
    if (packet.valid[i] == 0) continue;
    place.mover[i] = tracing.scene.moverOf(rays.hit.geomID[i]);
    const Vec3d direction = at(packet.direction, i), normal = at(hits.normal, i);
    const double square = hits.distance[i] * hits.distance[i], cosine = std::max(1e-9, -dot(direction, normal));
    const double lit = emitter.intensity(dot(direction, emitter.axis)) * cosine / square;  // W/m²
    // Seen from the emitter's middle, from where directions' shares are told.
    const Vec3d middle = emitter.position - at(hits.position, i);
    const double from_middle = std::max(1e-9, dot(middle, normal) / norm(middle));
    // leave() leaves such places to the other samples: what only a side of the emitter lights.
    if (-dot(middle, emitter.axis) < leastCosine(emitter) * norm(middle)) continue;
    const double density = pointsPerArea(perSteradian(emitter), from_middle, dot(middle, middle));
    place.density[i] = static_cast<float>(density);
    radiance[i] = static_cast<float>(static_cast<double>(hits.albedo[i]) / std::numbers::pi * lit * density /
                                     pointsPerArea(perSteradian(emitter), cosine, square));
  }
  LaneSums sums{tracing.turns_per_metre.size() * tracing.orders.size()};
  Lanes<double> length;
  for (std::size_t i = 0; i < kLaneCount; ++i) length[i] = hits.distance[i] + emitter.delay_m;
  clearSums(sums);
  addPhasors(tracing.turns_per_metre, tracing.orders, tracing.last_orders, radiance, length, sums);
  place.radiance[Channels::kSteady] = radiance;
  for (std::size_t k = 0; k < channels.lanes().size(); ++k) {
    place.radiance[Channels::re(k)] = sums.re[channels.lanes()[k]];
    place.radiance[Channels::im(k)] = sums.im[channels.lanes()[k]];
  }
}

namespace {

/// Where the ball is between a place and the receivers, less arrives, and nothing where its core is and neither is inside
/// the ball; not where either is on what is in it.
TOFTWIN_INLINE void hide(const LitPoints::Receivers& receivers, const Vec3fLanes& position, const Lanes<int>& mover,
                         const LitPoints::Ball& of, Lanes<float>& open) {
  const LitPoints::Ball ball = of;
  const Vec3fLanes& p = receivers.position;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float dx = position.x[i] - p.x[i], dy = position.y[i] - p.y[i], dz = position.z[i] - p.z[i];
    const float mx = ball.x - p.x[i], my = ball.y - p.y[i], mz = ball.z - p.z[i];
    const float along = (mx * dx + my * dy + mz * dz) / (dx * dx + dy * dy + dz * dz + 1e-12f);
    const float above = along > 0.0f ? along : 0.0f, t = above < 1.0f ? above : 1.0f;
    const float bx = mx - t * dx, by = my - t * dy, bz = mz - t * dz;
    const float nearest = bx * bx + by * by + bz * bz, square = ball.radius * ball.radius;
    const bool is_between = (nearest < square) & (mover[i] != ball.mover) & (receivers.mover[i] != ball.mover);
    const float ex = mx - dx, ey = my - dy, ez = mz - dz;
    const bool are_outside = (mx * mx + my * my + mz * mz >= square) & (ex * ex + ey * ey + ez * ez >= square);
    const float through = (nearest < ball.core * ball.core) & are_outside ? 0.0f : ball.open;
    open[i] = is_between ? open[i] * through : open[i];
  }
}

/// Says whether the place lights any of them.
TOFTWIN_VECTOR
bool weighOne(const LitPoints::Receivers& receivers, const LitPoints::Place& place,
              const std::vector<LitPoints::Ball>& balls, float directions, std::size_t k, LitPoints::Shares& shares) {
  const Vec3fLanes &p = receivers.position, &n = receivers.normal, &position = place.position, &normal = place.normal;
  const Lanes<float>& steady = place.radiance[Channels::kSteady];
  Lanes<float> share, way, open;
  int any = 0;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float dx = position.x[i] - p.x[i], dy = position.y[i] - p.y[i], dz = position.z[i] - p.z[i];
    const float square = dx * dx + dy * dy + dz * dz + 1e-12f;
    const float here = dx * n.x[i] + dy * n.y[i] + dz * n.z[i];
    const float there = -(dx * normal.x[i] + dy * normal.y[i] + dz * normal.z[i]);
    // g / (density + directions · g) of g = here · there / (π square²)
    const float g = here * there, area = 3.14159265f * square * square;
    const bool is_seen = (here > 0.0f) & (g > 0.0f) & (receivers.valid[i] != 0);
    share[i] = is_seen ? g / (place.density[i] * area + directions * g) : 0.0f;
    way[i] = __builtin_sqrtf(square);
    open[i] = 1.0f;
    any |= is_seen ? 1 : 0;
  }
  if (any == 0) return false;
  for (const LitPoints::Ball& ball : balls) hide(receivers, position, place.mover, ball, open);
  Lanes<float> total = shares.total, clear = shares.clear, behind = shares.behind;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float light = share[i] * steady[i];
    total[i] += light * open[i];
    clear[i] += open[i] == 1.0f ? light : 0.0f;
    behind[i] += (open[i] == 1.0f) | (open[i] == 0.0f) ? 0.0f : light;
  }
  shares.total = total;
  shares.clear = clear;
  shares.behind = behind;
  shares.share[k] = share;
  shares.way[k] = way;
  shares.open[k] = open;
  return true;
}

TOFTWIN_VECTOR
void pickBy(const Lanes<float>& share, const Lanes<float>& steady, const Lanes<float>& open,
            const Lanes<int>& is_behind, int number, Lanes<float>& left, Lanes<int>& picked) {
#pragma GCC unroll 1
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const bool is_of_kind = ((open[i] != 1.0f) == (is_behind[i] != 0)) & (open[i] != 0.0f);
    const float part = is_of_kind ? share[i] * steady[i] : 0.0f;
    const bool is_left = left[i] > 0.0f;
    left[i] -= is_left ? part : 0.0f;
    picked[i] = (is_left & (part > 0.0f)) ? number : picked[i];
  }
}

}  // namespace

void LitPoints::weigh(const Receivers& receivers, int directions, Shares& shares) const {
  shares.share.resize(places_.size());
  shares.way.resize(places_.size());
  shares.open.resize(places_.size());
  shares.lighting.clear();
  shares.total = {};
  shares.clear = shares.behind = {};
  for (std::size_t k = 0; k < places_.size(); ++k) {
    if (weighOne(receivers, places_[k], balls_, static_cast<float>(directions), k, shares))
      shares.lighting.push_back(k);
  }
}

namespace {

/// Adds share · open · radiance · exp(−i 2π n f way/c) of all points to the sums of one frequency's wanted harmonics,
/// whose phasors begin with number `first`: addTurned() without the harmonics that other frequencies want.
TOFTWIN_VECTOR
void addFrequency(float turns_per_metre, std::size_t first, std::size_t last, const Channels& channels,
                  const std::vector<LitPoints::Place>& places, const LitPoints::Shares& shares, LaneSums& sums) {
  const int* orders = channels.ordersOfTerms().data();
  const std::size_t* terms = channels.lanes().data();
  for (const std::size_t k : shares.lighting) {
    const std::vector<Lanes<float>>& radiance = places[k].radiance;
    Lanes<float> share, cosine, sine, re, im;
    for (std::size_t i = 0; i < kLaneCount; ++i) share[i] = shares.share[k][i] * shares.open[k][i];
    turnsOf(shares.way[k], turns_per_metre, share, cosine, sine, re, im);
    int order = 1;
    for (std::size_t phasor = first; phasor < last; ++phasor) {
      for (; order < orders[phasor]; ++order) turnBy(cosine, sine, re, im);
      addProduct(radiance[Channels::re(phasor)], radiance[Channels::im(phasor)], re, im, sums.re[terms[phasor]].v,
                 sums.im[terms[phasor]].v);
    }
  }
}

}  // namespace

void LitPoints::add(const Tracing& tracing, const Channels& channels, const Shares& shares, LaneSums& sums) const {
  for (std::size_t i = 0; i < kLaneCount; ++i) sums.steady[i] += shares.total[i];
  const std::size_t frequencies = tracing.turns_per_metre.size();
  for (std::size_t f = 0; f < frequencies; ++f) {
    const std::size_t last = f + 1 < frequencies ? channels.first(f + 1) : channels.terms().size();
    addFrequency(static_cast<float>(tracing.turns_per_metre[f]), channels.first(f), last, channels, places_, shares,
                 sums);
  }
}

void LitPoints::pick(const Shares& shares, const Lanes<float>& draws, const Lanes<int>& is_other, Pick& pick) const {
  constexpr float kOfBehind = kTurns, kOfClear = kOfBehind / (kOfBehind - 1.0f);
  Lanes<float> left;
  Lanes<int> is_behind;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const bool are_both = (shares.clear[i] > 0.0f) & (shares.behind[i] > 0.0f);
    is_behind[i] = are_both ? is_other[i] : shares.behind[i] > 0.0f ? 1 : 0;
    const float all = is_behind[i] != 0 ? shares.behind[i] : shares.clear[i];
    pick.steady[i] = are_both ? (is_behind[i] != 0 ? kOfBehind : kOfClear) * all : all;
    pick.point[i] = -1;
    // Not quite the total, so that rounding cannot leave the last of them out.
    left[i] = draws[i] * all * 0.999999f + 1e-30f;
  }
  for (const std::size_t k : shares.lighting)
    pickBy(shares.share[k], places_[k].radiance[Channels::kSteady], shares.open[k], is_behind, static_cast<int>(k),
           left, pick.point);
}

void LitPoints::placesOf(const Pick& pick, Vec3Lanes& places) const {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const Vec3fLanes& from = places_[static_cast<std::size_t>(std::max(0, pick.point[i]))].position;
    places.x[i] = static_cast<double>(from.x[i]);
    places.y[i] = static_cast<double>(from.y[i]);
    places.z[i] = static_cast<double>(from.z[i]);
  }
}

void LitPoints::mend(const Tracing& tracing, const Channels& channels, const Shares& shares, const Pick& pick,
                     const Lanes<int>& is_blocked, std::vector<Lanes<float>>& radiance, LaneSums& sums) const {
  Lanes<float> weight{};
  Lanes<double> way{};
  radiance.assign(channels.count(), Lanes<float>{});
  bool is_any = false;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    if (pick.point[i] < 0) continue;
    const auto k = static_cast<std::size_t>(pick.point[i]);
    const float wrong = (is_blocked[i] != 0 ? 0.0f : 1.0f) - shares.open[k][i];
    if (wrong == 0.0f) continue;
    is_any = true;
    weight[i] = wrong * pick.steady[i] / places_[k].radiance[Channels::kSteady][i];
    way[i] = static_cast<double>(shares.way[k][i]);
    for (std::size_t c = 0; c < radiance.size(); ++c) radiance[c][i] = places_[k].radiance[c][i];
  }
  if (is_any) addTurned(tracing, channels, weight, way, radiance, sums);
}

TOFTWIN_VECTOR
void LitPoints::leave(const PlacedEmitter& emitter, const Packet& packet, const Vec3Lanes& normals, const Hits& hits,
                      int directions, Lanes<float>& weight) const {
  const Vec3d from = emitter.position, axis = emitter.axis;
  const double per_steradian = perSteradian(emitter), n = directions, limit = leastCosine(emitter);
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const double dx = packet.direction.x[i], dy = packet.direction.y[i], dz = packet.direction.z[i];
    const double here = dx * normals.x[i] + dy * normals.y[i] + dz * normals.z[i];
    const double there = -(dx * hits.normal.x[i] + dy * hits.normal.y[i] + dz * hits.normal.z[i]);
    const double g = n * here * there / (3.14159265358979 * hits.distance[i] * hits.distance[i] + 1e-12);
    const double mx = from.x - hits.position.x[i], my = from.y - hits.position.y[i], mz = from.z - hits.position.z[i];
    const double square = mx * mx + my * my + mz * mz + 1e-12, per_way = perRoot(square);
    const double cosine = (mx * hits.normal.x[i] + my * hits.normal.y[i] + mz * hits.normal.z[i]) * per_way;
    const double lobe = -(mx * axis.x + my * axis.y + mz * axis.z) * per_way;
    const double q = pointsPerArea(per_steradian, cosine, square);
    // A disc also lights what its middle does not: that is the directions' alone.
    const bool is_shared = (cosine > 1e-9) & (lobe >= limit);
    weight[i] = is_shared ? static_cast<float>(g / (q + g)) : 1.0f;
  }
}

}  // namespace toftwin::sim
