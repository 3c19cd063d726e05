// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/indirect_tile.h"

#include <algorithm>

#include "sim/tracer/cast.h"
#include "sim/tracer/hit.h"
#include "sim/tracer/phasor.h"
#include "sim/tracer/shade.h"
#include "sim/tracer/special.h"

namespace toftwin::sim {
namespace {

/// Random dimensions of their own, beyond those of trace().
constexpr std::uint32_t kBounce = 0x10000, kPick = kBounce + 2, kRoulette = kBounce + 3;
/// A tile looks a surface further, for the cells, in one of so many frames once three quarters of those it asks know so
/// many samples, and all of them any. (Cells that remember fewer never do: where the camera moves fast.)
constexpr std::uint32_t kTurnsToLookFurther = 3;
constexpr int kManySamples = 96;
/// Of direct light that lit places leave less than this share of, so much is left to chance that what survives has this share:
/// away from corners that is nearly all, and what is dropped needs no ray to the emitter.
constexpr float kLeastShare = 0.15f;
/// Rays to a light end before its surface by this share of their way.
constexpr float kShortOfIt = 0.002f;

/// A tile's points share one sequence of random numbers: each takes so many in a row, evenly spread by themselves over
/// time, and after as many frames all points' together are.
constexpr std::uint32_t kInARow = 32;

/// Which of the sequence is sample `sample` of a tile's point.
std::uint32_t numberInSequence(std::uint32_t sample, std::size_t lane) {
  const auto point = static_cast<std::uint32_t>(lane);
  return (sample / kInARow * static_cast<std::uint32_t>(kLaneCount) + point) * kInARow + sample % kInARow;
}

PixelKey keyOfTile(const Tracing& tracing, int i, int j) {
  return pixelKey(tracing.seed, static_cast<std::uint32_t>(i * CoarseGrid::kStep),
                  static_cast<std::uint32_t>(j * CoarseGrid::kStep));
}

void prepareTile(const Tracing& tracing, int i, int j, Block& block) {
  const CameraInfo& camera = tracing.request.camera;
  block.shape = BlockShape::forSamples(1);
  Lanes<int> columns, rows;
  for (std::size_t lane = 0; lane < kLaneCount; ++lane) {
    const int l = static_cast<int>(lane);
    columns[lane] = std::min((i + l % 4) * CoarseGrid::kStep, camera.width - 1);
    rows[lane] = std::min((j + l / 4) * CoarseGrid::kStep, camera.height - 1);
    block.is_inside[lane] = -1;
    block.first_sample[lane] = 0;
    block.key_a[lane] = block.key_b[lane] = 0;  // middles need no random numbers
  }
  tracing.lens.raysOf(columns, rows, block.rays);
}

/// Light now is counted from these hits on: as if they were white and matt, and the way to them nothing.
void startAnew(Packet& packet, Hits& hits) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    packet.throughput[i] = 1.0f;
    packet.length[i] = 0.0;
    hits.distance[i] = 0.0;
    hits.albedo[i] = hits.shape_a[i] = 1.0f;
    hits.shape_b[i] = 0.0f;
  }
}

/// Paths that start anew at the points of a tile, and the hits that they are at. Where they came from does not count: there
/// surfaces are as if matt.
void startAt(const SeenTile& seen, PixelKey key, bool is_even, Packet& packet, Hits& hits) {
  startAnew(packet, hits);
  hits.position = packet.origin = seen.position;
  hits.normal = packet.direction = seen.normal;
  hits.start = seen.start;
  hits.emission = {};
  packet.valid = seen.valid;
  packet.is_even = is_even;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    packet.key_a[i] = key.a;
    packet.key_b[i] = key.b;
  }
}

/// Weighs light by shares of it; of small ones most are dropped, and the rest counts for them.
TOFTWIN_VECTOR
bool keepShares(const Packet& packet, const Lanes<float>& shares, DirectLight& light) {
  int any = 0;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float draw = independentPair(packet.key(i), packet.index[i], kRoulette).u * kLeastShare;
    const float share = shares[i] >= kLeastShare ? shares[i] : draw < shares[i] ? kLeastShare : 0.0f;
    light.weight[i] *= share;
    light.valid[i] = share > 0.0f ? light.valid[i] : 0;
    any |= light.valid[i];
  }
  return any != 0;
}

}  // namespace

TOFTWIN_VECTOR
void addTurned(const Tracing& tracing, const Channels& channels, const Lanes<float>& weight,
               const Lanes<double>& length, const std::vector<Lanes<float>>& light, LaneSums& sums) {
  const std::vector<int>& orders = tracing.orders;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    sums.steady[i] += weight[i] * light[Channels::kSteady][i];
    sums.ambient[i] += weight[i] * light[Channels::kAmbient][i];
  }
  std::size_t phasor = 0;
  for (std::size_t f = 0; f < tracing.turns_per_metre.size(); ++f) {
    Lanes<float> cosine, sine, turn_re, turn_im;
    turnsOf(length, tracing.turns_per_metre[f], weight, cosine, sine, turn_re, turn_im);
    std::size_t term = f * orders.size();
    for (int n = 1;; ++n) {
      const bool is_one = orders[term - f * orders.size()] == n;
      if (is_one && phasor < channels.lanes().size() && channels.lanes()[phasor] == term) {
        addProduct(light[Channels::re(phasor)], light[Channels::im(phasor)], turn_re, turn_im, sums.re[term].v,
                   sums.im[term].v);
        ++phasor;
      }
      if (is_one && (++term == (f + 1) * orders.size() || n == tracing.last_orders[f])) break;
      turnBy(cosine, sine, turn_re, turn_im);
    }
  }
}

TileGatherer::TileGatherer(const Tracing& tracing, const IrradianceCells& cells, const LitPoints& lights,
                           const Channels& channels)
    : tracing_(tracing),
      cells_(cells),
      lights_(lights),
      channels_(channels),
      sums_(tracing.turns_per_metre.size() * tracing.orders.size()),
      further_(sums_.re.size()),
      fallen_(sums_.re.size()),
      found_(channels.count()) {
  tile_.sums.resize(channels.count());
  tile_.lit.resize(channels.count());
  tile_.squares.resize(tracing.turns_per_metre.size());
}

void TileGatherer::look(int i, int j, SeenTile& seen) {
  Block block;
  Packet camera_rays;
  prepareTile(tracing_, i, j, block);
  preparePacket(tracing_, block, camera_rays);
  startInTheMiddle(tracing_, block, camera_rays);
  RTCRayHit16 rays;
  intersect(tracing_, camera_rays, rays, false);  // sixteen pixels apart they have little in common
  Lanes<float> unused{};
  endMissed(0.0f, rays, camera_rays, unused);
  findHits(tracing_.scene, camera_rays, rays, hits_);
  seen.valid = camera_rays.valid;
  seen.position = hits_.position;
  seen.normal = hits_.normal;
  seen.start = hits_.start;
  for (std::size_t lane = 0; lane < kLaneCount; ++lane) {
    seen.mover[lane] = camera_rays.valid[lane] != 0 ? tracing_.scene.moverOf(rays.hit.geomID[lane]) : 0;
  }
}

void TileGatherer::gather(int i, int j, const SeenTile& tile, std::uint32_t first_sample, int samples, CellUpdate& update) {
  keepGeometry(tile);
  std::fill(tile_.sums.begin(), tile_.sums.end(), Lanes<double>{});
  std::fill(tile_.squares.begin(), tile_.squares.end(), Lanes<double>{});
  std::fill(tile_.lit.begin(), tile_.lit.end(), Lanes<float>{});
  update.keys = {};
  update.values.resize(channels_.count());
  if (!isAny(tile.valid)) return;
  Packet start;
  Hits seen;
  startAt(tile, keyOfTile(tracing_, i, j), tracing_.request.sampler != Sampler::Plain, start, seen);
  hits_ = seen;
  normals_ = seen.normal;
  samples_ = samples;
  lookAtLights(tile.valid);
  const std::uint32_t turn = first_sample / static_cast<std::uint32_t>(samples) + static_cast<std::uint32_t>(i + j) / 4;
  for (int s = 0; s < samples; ++s) {
    const std::uint32_t sample = first_sample + static_cast<std::uint32_t>(s);
    Packet packet = start;
    for (std::size_t lane = 0; lane < kLaneCount; ++lane) packet.index[lane] = numberInSequence(sample, lane);
    hits_ = seen;
    clearSums(sums_);
    if (lights_.areAny()) mendLights(packet, sample, seen);
    follow(packet, s == 0 ? &update : nullptr, turn % kTurnsToLookFurther == 0);
    keepSums(tile.valid);
  }
}

/// The light that falls from lit points onto the coarse points.
void TileGatherer::lookAtLights(const Lanes<int>& valid) {
  clearSums(fallen_);
  if (!lights_.areAny()) return;
  lights_.weigh({inSingle(hits_.position), inSingle(normals_), valid, tile_.mover}, samples_, shares_);
  lights_.add(tracing_, channels_, shares_, fallen_);
  forEachChannel(fallen_, [&](std::size_t channel, const Lanes<float>& lanes) { tile_.lit[channel] = lanes; });
}

/// One of the lit points, picked by its share, says whether it is seen from here: in one of four turns of those that
/// are expected to arrive in part, in the others of those that nothing is expected to be in the way of. Neighbours have
/// other turns, so that in each frame both are mended around every place.
void TileGatherer::mendLights(const Packet& packet, std::uint32_t sample, const Hits& seen) {
  LitPoints::Pick pick;
  Lanes<float> draws;
  Lanes<int> is_other;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const std::uint32_t turn = sample + static_cast<std::uint32_t>(i % 4 + i / 4);
    const bool is_behind = turn % LitPoints::kTurns == 0;
    // Each kind goes on in its own sequence.
    const std::uint32_t number = is_behind ? turn / LitPoints::kTurns : turn - turn / LitPoints::kTurns - 1;
    const RandomPair draw = randomPair(packet.key(i), numberInSequence(number, i), kPick);
    is_other[i] = is_behind ? 1 : 0;
    draws[i] = is_behind ? draw.v : draw.u;
  }
  lights_.pick(shares_, draws, is_other, pick);
  Vec3Lanes places;
  lights_.placesOf(pick, places);
  RTCRay16 rays;
  setShadowRays(seen, places, rays);
  Lanes<int> valid, is_blocked;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    valid[i] = (packet.valid[i] != 0) & (pick.point[i] >= 0) ? -1 : 0;
    rays.tfar[i] *= 1.0f - kShortOfIt;
  }
  if (!isAny(valid)) return;
  castShadowRays(tracing_.scene, valid.v, rays, false);
  for (std::size_t i = 0; i < kLaneCount; ++i) is_blocked[i] = (valid[i] != 0) & (rays.tfar[i] < 0.0f) ? -1 : 0;
  lights_.mend(tracing_, channels_, shares_, pick, is_blocked, found_, sums_);
}

/// One sample of the light that falls onto the hits: from the surface there lit directly, and from what
/// the cells know of the other light on it. With `update` a further surface is looked at, for the cells, if it is the
/// tile's turn or if they know little.
void TileGatherer::follow(Packet& packet, CellUpdate* update, bool is_turn) {
  bounce(hits_, kBounce, true, packet);
  if (!meet(packet, 1, sums_) || tracing_.request.max_surfaces == 2) return;
  Lanes<IrradianceCells::Key> keys;
  const Lanes<int> known = addFromCells(packet, keys, sums_);
  if (update == nullptr) return;
  std::size_t asked = 0, many = 0;
  bool are_all_known = true;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    if (keys[i] == 0 || !(packet.throughput[i] * hits_.albedo[i] > 0.0f)) continue;
    ++asked;
    many += known[i] >= kManySamples ? 1 : 0;
    are_all_known = are_all_known && known[i] != 0;
  }
  if (!is_turn && are_all_known && 4 * many >= 3 * asked) return;
  Lanes<float> weight;
  Lanes<double> length;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    // Where the cells know too little, the sample itself is the best guess.
    const bool is_unknown = (keys[i] != 0) & (known[i] == 0);
    weight[i] = is_unknown ? packet.throughput[i] * hits_.albedo[i] : 0.0f;
    length[i] = packet.length[i] + hits_.distance[i];
  }
  lookFurther(packet);
  update->keys = keys;
  update->values[Channels::kSteady] = further_.steady;
  update->values[Channels::kAmbient] = further_.ambient;
  for (std::size_t phasor = 0; phasor < channels_.terms().size(); ++phasor) {
    update->values[Channels::re(phasor)] = further_.re[channels_.lanes()[phasor]];
    update->values[Channels::im(phasor)] = further_.im[channels_.lanes()[phasor]];
  }
  addTurned(tracing_, channels_, weight, length, update->values, sums_);
}

/// Goes on to the next surface and adds its own and its direct light. False if all lanes ended.
bool TileGatherer::meet(Packet& packet, int surface, LaneSums& sums) {
  RTCRayHit16 rays;
  intersect(tracing_, packet, rays, false);
  endMissed(tracing_.scene.ambient_radiance, rays, packet, sums.ambient);
  if (!isAny(packet.valid)) return false;
  findHits(tracing_.scene, packet, rays, hits_);
  applyTextures(tracing_.scene, rays, packet, hits_);
  addEmission(packet, hits_, sums.ambient);
  if (surface == 1 && lights_.areAny()) {
    addDirect(packet, sums);
  } else {
    gatherDirectLight(tracing_, packet, hits_, surface, false, sums);
  }
  return true;
}

/// Direct light of the hits, less what they send as lit points.
void TileGatherer::addDirect(const Packet& packet, LaneSums& sums) {
  Vec3Lanes places;
  DirectLight light;
  Lanes<float> shares;
  for (std::size_t e = 0; e < tracing_.emitters.size(); ++e) {
    if (!lookForLightOf(tracing_, e, packet, hits_, 1, places, light)) continue;
    lights_.leave(tracing_.emitters[e], packet, normals_, hits_, samples_, shares);
    if (!keepShares(packet, shares, light)) continue;
    takeOffShadowed(tracing_, hits_, places, false, light);
    addLight(tracing_, light, sums);
  }
}

/// One sample of the light that falls onto the present hits, into `further_`.
void TileGatherer::lookFurther(const Packet& at) {
  Packet packet = at;
  clearSums(further_);
  startAnew(packet, hits_);
  bounce(hits_, kBounce + 1, true, packet);
  if (!meet(packet, 2, further_)) return;
  Lanes<IrradianceCells::Key> keys;
  addFromCells(packet, keys, further_);
}

/// Adds what the cells know of the light on the present hits; says of how many samples they know it (0: not enough),
/// and which cells they are.
Lanes<int> TileGatherer::addFromCells(const Packet& packet, Lanes<IrradianceCells::Key>& keys,
                                      LaneSums& sums) {
  Lanes<int> known{};
  Lanes<float> weight{};
  Lanes<double> length;
  keys = {};
  for (Lanes<float>& lanes : found_) lanes = {};
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    length[i] = packet.length[i] + hits_.distance[i];
    if (packet.valid[i] == 0) continue;
    keys[i] = cells_.keyOf({hits_.position.x[i], hits_.position.y[i], hits_.position.z[i]},
                           {hits_.normal.x[i], hits_.normal.y[i], hits_.normal.z[i]});
    weight[i] = packet.throughput[i] * hits_.albedo[i];
    cells_.prepare(keys[i]);
  }
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    if (keys[i] == 0 || !(weight[i] > 0.0f)) continue;
    const auto [means, samples] = cells_.find(keys[i]);
    if (means.empty()) continue;
    known[i] = samples;
    for (std::size_t c = 0; c < means.size(); ++c) found_[c][i] = means[c];
  }
  addTurned(tracing_, channels_, weight, length, found_, sums);
  return known;
}

void TileGatherer::keepGeometry(const SeenTile& seen) {
  const auto& [ax, ay, az] = tracing_.camera_axes;
  tile_.valid = seen.valid;
  tile_.mover = seen.mover;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const bool is_hit = seen.valid[i] != 0;
    const Vec3d p = is_hit ? at(seen.position, i) - tracing_.pinhole : Vec3d{};
    const Vec3d n = is_hit ? at(seen.normal, i) : Vec3d{};
    tile_.x[i] = static_cast<float>(dot(ax, p));
    tile_.y[i] = static_cast<float>(dot(ay, p));
    tile_.z[i] = static_cast<float>(dot(az, p));
    tile_.normal_x[i] = static_cast<float>(dot(ax, n));
    tile_.normal_y[i] = static_cast<float>(dot(ay, n));
    tile_.normal_z[i] = static_cast<float>(dot(az, n));
  }
}

template <class Work>
void TileGatherer::forEachChannel(const LaneSums& sums, const Work& work) const {
  work(Channels::kSteady, sums.steady);
  work(Channels::kAmbient, sums.ambient);
  for (std::size_t phasor = 0; phasor < channels_.terms().size(); ++phasor) {
    work(Channels::re(phasor), sums.re[channels_.lanes()[phasor]]);
    work(Channels::im(phasor), sums.im[channels_.lanes()[phasor]]);
  }
}

void TileGatherer::keepSums(const Lanes<int>& valid) {
  forEachChannel(sums_, [&](std::size_t channel, const Lanes<float>& lanes) {
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      tile_.sums[channel][i] += valid[i] != 0 ? static_cast<double>(lanes[i]) : 0.0;
    }
  });
  const std::size_t harmonics = tracing_.orders.size();
  for (std::size_t f = 0; f < tile_.squares.size(); ++f) {
    const Lanes<float>&re = sums_.re[f * harmonics], &im = sums_.im[f * harmonics];
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      tile_.squares[f][i] += valid[i] != 0 ? static_cast<double>(re[i] * re[i] + im[i] * im[i]) : 0.0;
    }
  }
}

}  // namespace toftwin::sim
