// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/shared_paths.h"

#include <algorithm>
#include <cmath>

#include "sim/tracer/cast.h"
#include "sim/tracer/edge_pixels.h"
#include "sim/tracer/hit.h"
#include "sim/tracer/phasor.h"
#include "sim/tracer/shade.h"

namespace toftwin::sim {
namespace {

/// Tells a tile's random numbers from those of the pixel with the same coordinates.
constexpr std::uint32_t kTileSalt = 0x7f4a7c15u;

/// The first surfaces of a block's pixels.
struct Starts {
  Lanes<int> valid{};
  Hits hits{};
  Vec3Lanes direction{};  ///< of the camera's ray
};

/// A part of the light that leaves a surface: what came to it from one direction. Phasors are of lengths from
/// the surface on; the reflection's shape (material.h), which depends on where the light goes, is left out.
struct LightPart {
  explicit LightPart(std::size_t terms) : light(terms) {}
  Vec3Lanes from{};
  LaneSums light;
};

/// Where the paths arrived from the first surfaces, and the light that leaves these places. Lambertian
/// surfaces don't care where light comes from: where all are, one part has it all.
struct Ends {
  Ends(std::size_t terms, std::size_t parts_count) : parts(parts_count, LightPart{terms}) {}
  Lanes<int> valid{};
  Vec3Lanes position{}, normal{};
  Vec3fLanes start{};
  Vec3Lanes direction{};     ///< of the path that arrived
  Lanes<double> distance{};  ///< from its first surface
  Lanes<float> weight{};     ///< of its reflection there: albedo and shape
  Lanes<float> emission{}, shape_a{}, shape_b{};
  std::vector<LightPart> parts;  ///< of each emitter and, last, of all other surfaces; or one
};

/// One of them.
struct End {
  Vec3d position, normal, start, direction;
  double distance;
  float weight, shape_a, shape_b;
  std::size_t lane;
};

/// Connections of a block's starts to one end.
struct Connections {
  Lanes<int> valid;
  Lanes<double> density;  ///< π p_i
  Lanes<float> shape;     ///< of the reflection towards the camera, albedo included
  Vec3Lanes direction;    ///< to the end
  Lanes<double> far_cosine;
  Lanes<double> length;  ///< from the pinhole to the end
  RTCRay16 rays;
};

TOFTWIN_VECTOR
void connect(const Starts& starts, const End& end, Connections& to) {
  const Vec3d p = end.position, n = end.normal, s = end.start;
#pragma GCC ivdep
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const Hits& hits = starts.hits;
    const double dx = p.x - hits.position.x[i], dy = p.y - hits.position.y[i], dz = p.z - hits.position.z[i];
    const double squared = dx * dx + dy * dy + dz * dz, per_distance = perRoot(squared);
    const double ux = dx * per_distance, uy = dy * per_distance, uz = dz * per_distance;
    const double nx = hits.normal.x[i], ny = hits.normal.y[i], nz = hits.normal.z[i];
    const double cosine = ux * nx + uy * ny + uz * nz, far_cosine = -(ux * n.x + uy * n.y + uz * n.z);
    const double vx = -starts.direction.x[i], vy = -starts.direction.y[i], vz = -starts.direction.z[i];
    const float shape =
        hits.albedo[i] * shapeOf(hits.shape_a[i], hits.shape_b[i], ux * vx + uy * vy + uz * vz, cosine,
                                 vx * nx + vy * ny + vz * nz);
    const bool is_facing = (starts.valid[i] != 0) & (cosine > 0.0) & (far_cosine > 0.0);
    to.shape[i] = is_facing ? shape : 0.0f;  // what is not connected may be no number
    to.density[i] = is_facing ? cosine * far_cosine * per_distance * per_distance : 0.0;
    to.valid[i] = is_facing ? -1 : 0;
    to.direction.x[i] = ux;
    to.direction.y[i] = uy;
    to.direction.z[i] = uz;
    to.far_cosine[i] = far_cosine;
    to.length[i] = is_facing ? hits.distance[i] + squared * per_distance : 0.0;
    const float ox = hits.start.x[i], oy = hits.start.y[i], oz = hits.start.z[i];
    const double wx = s.x - static_cast<double>(ox), wy = s.y - static_cast<double>(oy),
                 wz = s.z - static_cast<double>(oz);
    const double way_squared = wx * wx + wy * wy + wz * wz, per_way = perRoot(way_squared);
    to.rays.org_x[i] = ox;
    to.rays.org_y[i] = oy;
    to.rays.org_z[i] = oz;
    to.rays.dir_x[i] = static_cast<float>(wx * per_way);
    to.rays.dir_y[i] = static_cast<float>(wy * per_way);
    to.rays.dir_z[i] = static_cast<float>(wz * per_way);
    to.rays.tfar[i] = static_cast<float>(way_squared * per_way * (1.0 - 0x1p-22));
  }
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    to.rays.tnear[i] = 0.0f;
    to.rays.time[i] = 0.0f;
    to.rays.mask[i] = 0xffffffffu;
    to.rays.id[i] = 0;
    to.rays.flags[i] = 0;
  }
}

/// Each start's share in the end's light, albedo and shape of the first reflection included.
TOFTWIN_VECTOR
void weigh(const Connections& to, double per_density, Lanes<float>& weight) {
  for (std::size_t i = 0; i < kLaneCount; ++i)
    weight[i] = to.shape[i] * static_cast<float>(to.density[i] * per_density);
}

/// Times the shape of the end's reflection of light from one direction.
TOFTWIN_VECTOR
void shapePart(const Connections& to, const End& end, Vec3d from, Lanes<float>& weight) {
  const double cosine = dot(from, end.normal);
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const double between =
        -(to.direction.x[i] * from.x + to.direction.y[i] * from.y + to.direction.z[i] * from.z);
    const float shape = shapeOf(end.shape_a, end.shape_b, between, cosine, to.far_cosine[i]);
    weight[i] = weight[i] > 0.0f ? weight[i] * shape : 0.0f;
  }
}

/// Adds a part of the end's light to the starts', phase and all. As in lit_points.cpp, its loops are told to stay loops,
/// so that GCC makes vectors of them.
TOFTWIN_VECTOR
void addShared(const Tracing& tracing, const Connections& to, const Lanes<float>& weight,
               const LaneSums& light, std::size_t lane, LaneSums& sums) {
  const float steady = light.steady[lane], ambient = light.ambient[lane];
#pragma GCC unroll 1
  for (std::size_t i = 0; i < kLaneCount; ++i) sums.steady[i] += weight[i] * steady;
#pragma GCC unroll 1
  for (std::size_t i = 0; i < kLaneCount; ++i) sums.ambient[i] += weight[i] * ambient;
  const auto harmonics = static_cast<std::size_t>(tracing.request.harmonics);
  for (std::size_t f = 0; f < tracing.turns_per_metre.size(); ++f) {
    const double turns = tracing.turns_per_metre[f];
    Lanes<float> cosine, sine, re, im, next;
    turnsOf(to.length, turns, weight, cosine, sine, re, im);
    for (std::size_t n = 0;; ++n) {
      const std::size_t term = f * harmonics + n;
      const float light_re = light.re[term][lane], light_im = light.im[term][lane];
      Lanes<float> sum = sums.re[term];
#pragma GCC unroll 1
      for (std::size_t i = 0; i < kLaneCount; ++i) sum[i] += re[i] * light_re - im[i] * light_im;
      sums.re[term] = sum;
      sum = sums.im[term];
#pragma GCC unroll 1
      for (std::size_t i = 0; i < kLaneCount; ++i) sum[i] += re[i] * light_im + im[i] * light_re;
      sums.im[term] = sum;
      if (n + 1 == harmonics) break;
#pragma GCC unroll 1
      for (std::size_t i = 0; i < kLaneCount; ++i) next[i] = re[i] * cosine[i] - im[i] * sine[i];
#pragma GCC unroll 1
      for (std::size_t i = 0; i < kLaneCount; ++i) im[i] = re[i] * sine[i] + im[i] * cosine[i];
      re = next;
    }
  }
}

bool isDark(const LaneSums& light, std::size_t lane) {
  return light.steady[lane] == 0.0f && light.ambient[lane] == 0.0f;
}

bool isDark(const Ends& ends, std::size_t lane) {
  return ends.emission[lane] == 0.0f &&
         std::ranges::all_of(ends.parts, [&](const LightPart& part) { return isDark(part.light, lane); });
}

/// The first surfaces of the block's sample: their own light, of edges without direct light, and who goes on from
/// there.
bool start(const Tracing& tracing, const Block& block, const Lanes<int>& edges, int sample, int last, Packet& packet,
           Lanes<int>& started, Starts& starts, LaneSums& sums) {
  constexpr bool is_coherent = true;
  preparePacket(tracing, block, packet);
  startAtPlaces(tracing, block, sample, last, packet);
  started = packet.valid;
  RTCRayHit16 rays;
  intersect(tracing, packet, rays, is_coherent);
  endMissed(tracing.scene.ambient_radiance, rays, packet, sums.ambient);
  starts.valid = packet.valid;
  starts.direction = packet.direction;
  if (!isAny(packet.valid)) return false;
  findHits(tracing.scene, packet, rays, starts.hits);
  addEmission(packet, starts.hits, sums.ambient);
  for (std::size_t i = 0; i < kLaneCount; ++i) packet.valid[i] &= ~edges[i];
  gatherDirectLight(tracing, packet, starts.hits, 0, is_coherent, sums);
  packet.valid = starts.valid;
  return true;
}

/// followFrom() on the ends' surfaces, each direction of incoming light by itself.
void followInParts(const Tracing& tracing, Packet& packet, RTCRayHit16& rays, Hits& hits, Ends& ends) {
  const Dimensions dimensions{static_cast<std::uint32_t>(tracing.emitters.size())};
  ends.emission = hits.emission;
  ends.shape_a = hits.shape_a;
  ends.shape_b = hits.shape_b;
  for (float& a : hits.shape_a.v) a = 1.0f;
  for (float& b : hits.shape_b.v) b = 0.0f;
  for (std::size_t e = 0; e < tracing.emitters.size(); ++e) {
    Vec3Lanes places;
    gatherLightOf(tracing, e, packet, hits, 1, false, places, ends.parts[e].light);
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const Vec3d from = normalised(Vec3d{places.x[i] - hits.position.x[i], places.y[i] - hits.position.y[i],
                                          places.z[i] - hits.position.z[i]});
      ends.parts[e].from.x[i] = from.x;
      ends.parts[e].from.y[i] = from.y;
      ends.parts[e].from.z[i] = from.z;
    }
  }
  const int surfaces = tracing.request.max_surfaces;
  LightPart& rest = ends.parts.back();
  if (surfaces == 2 && tracing.scene.ambient_radiance == 0.0f) return;
  bounce(hits, dimensions.bounce(1), 1 < kEvenBounces, packet);
  rest.from = packet.direction;
  playRoulette(dimensions.roulette(1), kRouletteThreshold, packet);
  if (!isAny(packet.valid)) return;
  intersect(tracing, packet, rays, false);
  endMissed(tracing.scene.ambient_radiance, rays, packet, rest.light.ambient);
  if (surfaces == 2 || !isAny(packet.valid)) return;
  findHits(tracing.scene, packet, rays, hits);
  followFrom(tracing, 2, packet, rays, hits, rest.light);
}

/// Sends the paths on from the first surfaces to their ends.
void follow(const Tracing& tracing, const Tile& tile, int sample, int block, const Starts& starts,
            Packet& packet, Ends& ends, LaneSums& sums) {
  const Dimensions dimensions{static_cast<std::uint32_t>(tracing.emitters.size())};
  const int first = sample * Tile::kPixels + block * static_cast<int>(kLaneCount);
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    packet.key_a[i] = tile.key.a;
    packet.key_b[i] = tile.key.b;
    packet.index[i] = static_cast<std::uint32_t>(first) + static_cast<std::uint32_t>(i);
  }
  bounce(starts.hits, dimensions.bounce(0), true, packet);
  ends.direction = packet.direction;
  ends.weight = packet.throughput;
  RTCRayHit16 rays;
  intersect(tracing, packet, rays, false);
  endMissed(tracing.scene.ambient_radiance, rays, packet, sums.ambient);
  ends.valid = packet.valid;
  if (!isAny(packet.valid)) return;
  Hits hits;
  findHits(tracing.scene, packet, rays, hits);
  ends.position = hits.position;
  ends.normal = hits.normal;
  ends.start = hits.start;
  ends.distance = hits.distance;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    packet.throughput[i] = 1.0f;
    packet.length[i] = -hits.distance[i];
  }
  for (LightPart& part : ends.parts) clearSums(part.light);
  ends.emission = {};
  if (ends.parts.size() == 1) {
    followFrom(tracing, 1, packet, rays, hits, ends.parts[0].light);
  } else {
    followInParts(tracing, packet, rays, hits, ends);
  }
}

End endOf(const Ends& ends, std::size_t i) {
  const auto wide = [](float x) { return static_cast<double>(x); };
  return {{ends.position.x[i], ends.position.y[i], ends.position.z[i]},
          {ends.normal.x[i], ends.normal.y[i], ends.normal.z[i]},
          {wide(ends.start.x[i]), wide(ends.start.y[i]), wide(ends.start.z[i])},
          {ends.direction.x[i], ends.direction.y[i], ends.direction.z[i]},
          ends.distance[i],
          ends.weight[i],
          ends.shape_a[i],
          ends.shape_b[i],
          i};
}

using Tiles = std::array<Starts, Tile::kBlocks>;

/// From a pixel on the very edge of two walls a path arrives on the other wall after no way at all: both ends
/// are the same place to rounding, and their difference has no direction. Its density is without bounds
/// there, next to which that of every other pixel is nothing: the end is this pixel's alone. Without this its
/// neighbours, which see that end as well as any, would take it for one of theirs.
void keepOwn(const Starts& starts, const End& end, Connections& to) {
  constexpr double kUnbounded = 1e30;
  const std::size_t i = end.lane;
  if (to.density[i] > 0.0) return;
  to.density[i] = kUnbounded;
  to.shape[i] = end.weight;
  to.direction.x[i] = end.direction.x;
  to.direction.y[i] = end.direction.y;
  to.direction.z[i] = end.direction.z;
  to.far_cosine[i] = -dot(end.direction, end.normal);
  to.length[i] = starts.hits.distance[i] + end.distance;
}

/// Connects all starts of the tile to the end, whose own pixel is lane `end.lane` of block `own`. Returns Σ π
/// p_k.
double connectAll(const Tracing& tracing, const Tiles& starts, const End& end, std::size_t own,
                  std::array<Connections, Tile::kBlocks>& to) {
  constexpr bool is_coherent = true;
  double density = 0.0;
  for (std::size_t b = 0; b < to.size(); ++b) {
    connect(starts[b], end, to[b]);
    // The path came this way: no shadow ray may doubt it.
    if (b == own) {
      to[b].valid[end.lane] = 0;
      keepOwn(starts[b], end, to[b]);
    }
    if (isAny(to[b].valid)) {
      record(tracing.log, to[b].valid, to[b].rays, is_coherent, true);
      castShadowRays(tracing.scene, to[b].valid.v, to[b].rays, is_coherent);
      for (std::size_t i = 0; i < kLaneCount; ++i) {
        const bool is_hidden = (to[b].valid[i] != 0) & (to[b].rays.tfar[i] < 0.0f);
        to[b].density[i] = is_hidden ? 0.0 : to[b].density[i];
      }
    }
    for (std::size_t i = 0; i < kLaneCount; ++i) density += to[b].density[i];
  }
  return density;
}

/// Shares the light of lane `i` of the block's ends.
void share(const Tracing& tracing, const Tiles& starts, const Ends& ends, std::size_t block, std::size_t i,
           TileSums& sums) {
  const End end = endOf(ends, i);
  std::array<Connections, Tile::kBlocks> to;
  const double density = connectAll(tracing, starts, end, block, to);
  if (!(density > 0.0)) return;
  for (std::size_t b = 0; b < to.size(); ++b) {
    Lanes<float> weight;
    LaneSums& lanes = sums[b].of_packet;
    weigh(to[b], 1.0 / density, weight);
    for (std::size_t lane = 0; lane < kLaneCount; ++lane)
      lanes.ambient[lane] += weight[lane] * ends.emission[i];
    for (const LightPart& part : ends.parts) {
      if (isDark(part.light, i)) continue;
      Lanes<float> shaped = weight;
      if (ends.parts.size() > 1)
        shapePart(to[b], end, {part.from.x[i], part.from.y[i], part.from.z[i]}, shaped);
      addShared(tracing, to[b], shaped, part.light, i, lanes);
    }
  }
}

/// One sample of every pixel, added to the packets' sums.
void traceSample(const Tracing& tracing, const Tile& tile, int sample, int last,
                 std::array<Lanes<int>, Tile::kBlocks>& started, Tiles& starts, std::vector<Ends>& ends,
                 TileSums& sums) {
  Packet packet;
  for (std::size_t b = 0; b < starts.size(); ++b) {
    LaneSums& lanes = sums[b].of_packet;
    ends[b].valid = {};
    if (!start(tracing, tile.blocks[b], tile.edges[b], sample, last, packet, started[b], starts[b], lanes)) continue;
    follow(tracing, tile, sample, static_cast<int>(b), starts[b], packet, ends[b], lanes);
  }
  for (std::size_t b = 0; b < ends.size(); ++b) {
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      if (ends[b].valid[i] != 0 && !isDark(ends[b], i)) share(tracing, starts, ends[b], b, i, sums);
    }
  }
}

}  // namespace

bool canShare(const Scene::Impl& scene, const TraceRequest& request) {
  return scene.is_matt && request.gates.empty() && request.max_surfaces > 1;
}

void prepareTile(const Tracing& tracing, int x, int y, Tile& tile) {
  constexpr int kBlockSide = Tile::kBlockShape.width;
  for (int b = 0; b < Tile::kBlocks; ++b) {
    prepareBlock(tracing, Tile::kBlockShape, x + b % 2 * kBlockSide, y + b / 2 * kBlockSide,
                 tile.blocks[static_cast<std::size_t>(b)]);
  }
  const PixelKey corner =
      pixelKey(tracing.seed, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
  tile.key = salted(corner, kTileSalt);
  lookAtCorners(tracing, tile);
}

void traceTile(const Tracing& tracing, const Tile& tile, int first, int last, int batch, TileSums& sums) {
  const auto harmonics = static_cast<std::size_t>(tracing.request.harmonics);
  const bool is_rough =
      std::ranges::any_of(tracing.scene.rows, [](const ObjectRow& row) { return row.material.b != 0.0f; });
  Tiles starts;
  std::array<Lanes<int>, Tile::kBlocks> started;
  std::vector<Ends> ends(Tile::kBlocks, Ends{sums[0].re.size(), is_rough ? tracing.emitters.size() + 1 : 1});
  for (int sample = first; sample < last; sample += batch) {
    const int end = std::min(last, sample + batch);
    for (BlockSums& block : sums) clearSums(block.of_packet);
    for (int i = sample; i < end; ++i) traceSample(tracing, tile, i, last, started, starts, ends, sums);
    for (std::size_t b = 0; b < starts.size(); ++b) fold(harmonics, started[b], end - sample, sums[b]);
  }
}

}  // namespace toftwin::sim
