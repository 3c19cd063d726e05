// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/path.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include "sim/tracer/hit.h"
#include "sim/tracer/random.h"
#include "sim/tracer/shade.h"

namespace toftwin::sim {
namespace {

using embree::kLanes;

/// Below this throughput a path survives by chance and is weighted up. Unbiased; with it, a path of
/// albedo 0.8 is followed for ten surfaces before the first draw.
constexpr float kRouletteThreshold = 0.1f;

/// So many bounces of a pixel's samples are spread evenly over all directions.
constexpr int kEvenBounces = 2;

/// Which pixel of the block each lane works for; −1: none.
using LanePixels = std::array<int, kLaneCount>;

/// Numbers of a path's random dimensions.
struct Dimensions {
  std::uint64_t emitters;
  static constexpr std::uint64_t kFootprint = 0;
  [[nodiscard]] std::uint64_t bounce(int surface) const { return first(surface); }
  [[nodiscard]] std::uint64_t roulette(int surface) const { return first(surface) + 1; }
  [[nodiscard]] std::uint64_t emitter(int surface, std::size_t e) const { return first(surface) + 2 + e; }

 private:
  [[nodiscard]] std::uint64_t first(int surface) const {
    return 1 + static_cast<std::uint64_t>(surface) * (2 + emitters);
  }
};

bool isAny(const Lanes<int>& valid) {
  return std::any_of(std::begin(valid.v), std::end(valid.v), [](int v) { return v != 0; });
}

void record(RayLog* log, const Lanes<int>& valid, const RTCRay16& rays, bool coherent, bool shadow) {
  if (log == nullptr) return;
  RayLog::Packet& packet = log->packets.emplace_back();
  std::copy(std::begin(valid.v), std::end(valid.v), packet.valid);
  packet.rays = rays;
  packet.is_coherent = coherent;
  packet.is_shadow = shadow;
}

/// Finds where each living path goes; lanes that meet nothing get no geometry id.
void intersect(const Tracing& tracing, const Packet& packet, RTCRayHit16& rays, bool coherent) {
  setRays(packet, rays);
  record(tracing.log, packet.valid, rays.ray, coherent, false);
  embree::intersect(packet.valid.v, tracing.scene.embree, rays, coherent);
}

/// Takes what the scene knows of each lane's hit. Paths that meet nothing end, with the surroundings'
/// light.
void collectHits(const Tracing& tracing, const RTCRayHit16& rays, Packet& packet, Hits& hits, LaneSums& sums) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const bool is_missed = rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID;
    if (packet.valid[i] != 0 && is_missed) {
      sums.ambient[i] += packet.throughput[i] * tracing.scene.ambient_radiance;
      packet.valid[i] = 0;
    }
    Contact contact{.normal = {0, 0, 1}, .level = 0.0, .distance = 1.0, .offset = 0.0, .onto = {}, .inside = {}};
    Material material{.albedo = 0.0f};
    if (packet.valid[i] != 0) {
      const BuiltObject& object = tracing.scene.objects[rays.hit.geomID[i]];
      contact = contactOf(object, rays.hit.primID[i], rays.hit.u[i], rays.hit.v[i], rays.ray.tfar[i],
                          {packet.origin.x[i], packet.origin.y[i], packet.origin.z[i]},
                          {packet.direction.x[i], packet.direction.y[i], packet.direction.z[i]});
      material = tracing.scene.materials[object.material];
      sums.ambient[i] += packet.throughput[i] * material.emission;
    }
    hits.normal.x[i] = contact.normal.x;
    hits.normal.y[i] = contact.normal.y;
    hits.normal.z[i] = contact.normal.z;
    hits.level[i] = contact.level;
    hits.distance[i] = contact.distance;
    hits.offset[i] = contact.offset;
    hits.onto.x[i] = contact.onto.x;
    hits.onto.y[i] = contact.onto.y;
    hits.onto.z[i] = contact.onto.z;
    hits.inside.x[i] = contact.inside.x;
    hits.inside.y[i] = contact.inside.y;
    hits.inside.z[i] = contact.inside.z;
    hits.albedo[i] = material.albedo;
    hits.shape_a[i] = material.a;
    hits.shape_b[i] = material.b;
  }
  placeHits(packet, hits);
}

/// Next-event estimation: from every hit to every emitter.
void gatherDirectLight(const Tracing& tracing, const Packet& packet, const Hits& hits, int surface, bool coherent,
                       LaneSums& sums) {
  const Dimensions dimensions{tracing.emitters.size()};
  for (std::size_t e = 0; e < tracing.emitters.size(); ++e) {
    const PlacedEmitter& emitter = tracing.emitters[e];
    Vec3Lanes places;
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      Vec3d place = emitter.position;
      if (emitter.is_disc) {
        const RandomPair random = randomPair(packet.key[i], packet.index[i], dimensions.emitter(surface, e));
        place = emitter.place(random.u, random.v);
      }
      places.x[i] = place.x;
      places.y[i] = place.y;
      places.z[i] = place.z;
    }
    DirectLight light;
    lightHits(packet, hits, emitter, places, light);
    if (!isAny(light.valid)) continue;
    RTCRay16 rays;
    setShadowRays(hits, places, rays);
    record(tracing.log, light.valid, rays, coherent, true);
    embree::occluded(light.valid.v, tracing.scene.embree, rays, coherent);
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      if (rays.tfar[i] < 0.0f) light.weight[i] = 0.0f;
    }
    addPhasors(tracing.turns_per_metre, tracing.request.harmonics, light.weight, light.length, sums);
  }
}

void playRoulette(std::uint64_t dimension, Packet& packet) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    float& throughput = packet.throughput[i];
    if (packet.valid[i] == 0 || !(throughput < kRouletteThreshold)) continue;
    const double survival = static_cast<double>(throughput / kRouletteThreshold);
    throughput = kRouletteThreshold;
    if (!(independentPair(packet.key[i], packet.index[i], dimension).u < survival)) packet.valid[i] = 0;
  }
}

/// Follows sixteen paths over all their surfaces.
void followPaths(const Tracing& tracing, Packet& packet, LaneSums& sums) {
  const Dimensions dimensions{tracing.emitters.size()};
  const int surfaces = tracing.request.max_surfaces;
  RTCRayHit16 rays;
  Hits hits;
  for (int surface = 0; isAny(packet.valid); ++surface) {
    const bool is_coherent = surface == 0;
    intersect(tracing, packet, rays, is_coherent);
    if (surface == surfaces) break;
    collectHits(tracing, rays, packet, hits, sums);
    if (!isAny(packet.valid)) return;
    gatherDirectLight(tracing, packet, hits, surface, is_coherent, sums);
    // Where the surroundings shine, the last surface must still look for them.
    if (surface + 1 == surfaces && tracing.scene.ambient_radiance == 0.0f) return;
    bounce(hits, dimensions.bounce(surface), surface < kEvenBounces, packet);
    playRoulette(dimensions.roulette(surface), packet);
  }
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    if (packet.valid[i] != 0 && rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) {
      sums.ambient[i] += packet.throughput[i] * tracing.scene.ambient_radiance;
    }
  }
}

/// Puts a path's start into a lane.
void start(const Tracing& tracing, Packet& packet, std::size_t lane, Vec3d direction_in_camera) {
  const auto& axes = tracing.camera_axes;
  const Vec3d direction = axes[0] * direction_in_camera.x + axes[1] * direction_in_camera.y + axes[2] * direction_in_camera.z;
  packet.valid[lane] = -1;
  packet.origin.x[lane] = tracing.pinhole.x;
  packet.origin.y[lane] = tracing.pinhole.y;
  packet.origin.z[lane] = tracing.pinhole.z;
  packet.start.x[lane] = static_cast<float>(tracing.pinhole.x);
  packet.start.y[lane] = static_cast<float>(tracing.pinhole.y);
  packet.start.z[lane] = static_cast<float>(tracing.pinhole.z);
  packet.direction.x[lane] = direction.x;
  packet.direction.y[lane] = direction.y;
  packet.direction.z[lane] = direction.z;
  packet.throughput[lane] = 1.0f;
}

/// The lanes' sums go to their pixels, and their squares to the variance.
void fold(const Tracing& tracing, const LanePixels& pixels, const LaneSums& lanes, BlockSums& sums) {
  const auto harmonics = static_cast<std::size_t>(tracing.request.harmonics);
  const std::size_t frequencies = tracing.turns_per_metre.size(), terms = frequencies * harmonics;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    if (pixels[i] < 0) continue;
    const auto p = static_cast<std::size_t>(pixels[i]);
    sums.pixels[p].steady += static_cast<double>(lanes.steady[i]);
    sums.pixels[p].ambient += static_cast<double>(lanes.ambient[i]);
    ++sums.pixels[p].samples;
    for (std::size_t term = 0; term < terms; ++term) {
      const std::complex<double> z{static_cast<double>(lanes.re[term][i]), static_cast<double>(lanes.im[term][i])};
      sums.phasors[p * terms + term] += z;
      if (term % harmonics == 0) sums.squares[p * frequencies + term / harmonics] += std::norm(z);
    }
  }
}

}  // namespace

Tracing::Tracing(const Scene::Impl& s, const TraceRequest& r, RayLog* l)
    : scene(s), request(r), log(l), scene_from_camera(r.world_from_camera) {
  scene_from_camera.translation_m = scene_from_camera.translation_m - scene.origin_in_world;
  pinhole = scene_from_camera.translation_m;
  camera_axes = {scene_from_camera.rotate({1, 0, 0}), scene_from_camera.rotate({0, 1, 0}), scene_from_camera.rotate({0, 0, 1})};
  for (const EmitterSpec& emitter : request.emitters) emitters.emplace_back(emitter, scene_from_camera);
  for (const Frequency f : request.frequencies) turns_per_metre.push_back(f.in(hertz) / kSpeedOfLight_m_per_s);
}

BlockShape BlockShape::forSamples(int samples_per_pixel) {
  BlockShape shape;
  shape.samples = std::min(kLanes, static_cast<int>(std::bit_ceil(static_cast<unsigned>(samples_per_pixel))));
  for (int pixels = kLanes / shape.samples; pixels > 1; pixels /= 2) {
    (shape.width > shape.height ? shape.height : shape.width) *= 2;
  }
  return shape;
}

BlockSums::BlockSums(int count, std::size_t frequencies, int harmonics)
    : pixels(static_cast<std::size_t>(count)),
      phasors(pixels.size() * frequencies * static_cast<std::size_t>(harmonics)),
      squares(pixels.size() * frequencies) {}

void BlockSums::clear() {
  std::fill(pixels.begin(), pixels.end(), Pixel{});
  std::fill(phasors.begin(), phasors.end(), std::complex<double>{});
  std::fill(squares.begin(), squares.end(), 0.0);
}

BlockSums& BlockSums::operator+=(const BlockSums& other) {
  for (std::size_t p = 0; p < pixels.size(); ++p) {
    pixels[p].steady += other.pixels[p].steady;
    pixels[p].ambient += other.pixels[p].ambient;
    pixels[p].samples += other.pixels[p].samples;
  }
  for (std::size_t i = 0; i < phasors.size(); ++i) phasors[i] += other.phasors[i];
  for (std::size_t i = 0; i < squares.size(); ++i) squares[i] += other.squares[i];
  return *this;
}

Block::Block(const Tracing& tracing, const BlockShape& s, int left, int top) : shape(s), x(left), y(top) {
  for (int p = 0; p < shape.pixels(); ++p) {
    rays[static_cast<std::size_t>(p)] = raysOfPixel(tracing.request.camera, x + p % shape.width, y + p / shape.width);
  }
}

void traceBlock(const Tracing& tracing, const Block& block, int first, int last, BlockSums& sums) {
  const TraceRequest& request = tracing.request;
  const BlockShape& shape = block.shape;
  LaneSums lanes{tracing.turns_per_metre.size() * static_cast<std::size_t>(request.harmonics)};
  for (int sample = first; sample < last; sample += shape.samples) {
    Packet packet;
    LanePixels pixels;
    lanes.clear();
    for (int lane = 0; lane < kLanes; ++lane) {
      const auto i = static_cast<std::size_t>(lane);
      const int p = lane / shape.samples, index = sample + lane % shape.samples;
      const int u = block.x + p % shape.width, v = block.y + p / shape.width;
      pixels[i] = -1;
      if (index >= last || u >= request.camera.width || v >= request.camera.height) continue;
      pixels[i] = p;
      packet.key[i] = pixelKey(request.seed, static_cast<std::uint64_t>(v) << 32 | static_cast<std::uint32_t>(u));
      packet.index[i] = static_cast<std::uint32_t>(index);
      const RandomPair at = randomPair(packet.key[i], packet.index[i], Dimensions::kFootprint);
      start(tracing, packet, i,
            block.rays[static_cast<std::size_t>(p)].direction((at.u - 0.5) * request.pixel_extent,
                                                        (at.v - 0.5) * request.pixel_extent));
    }
    followPaths(tracing, packet, lanes);
    fold(tracing, pixels, lanes, sums);
  }
}

std::array<TruthPixel, kLaneCount> traceTruth(const Tracing& tracing, const Block& block) {
  const CameraInfo& camera = tracing.request.camera;
  const BlockShape& shape = block.shape;
  std::array<TruthPixel, kLaneCount> pixels;
  Packet packet;
  for (int p = 0; p < shape.pixels(); ++p) {
    const int u = block.x + p % shape.width, v = block.y + p / shape.width;
    if (u >= camera.width || v >= camera.height) continue;
    const auto i = static_cast<std::size_t>(p);
    start(tracing, packet, i, block.rays[i].direction(0.0, 0.0));
  }
  RTCRayHit16 rays;
  Hits hits;
  LaneSums unused{0};
  intersect(tracing, packet, rays, true);
  collectHits(tracing, rays, packet, hits, unused);
  const Transform<Camera, World> camera_from_scene = tracing.scene_from_camera.inverse();
  for (std::size_t i = 0; i < static_cast<std::size_t>(shape.pixels()); ++i) {
    constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
    pixels[i] = {.range_m = kNothing, .albedo = kNothing, .normal = {}};
    if (packet.valid[i] == 0) continue;
    const Vec3d normal = camera_from_scene.rotate({hits.normal.x[i], hits.normal.y[i], hits.normal.z[i]});
    pixels[i] = {.range_m = static_cast<float>(hits.distance[i]),
                 .albedo = hits.albedo[i],
                 .normal = {static_cast<float>(normal.x), static_cast<float>(normal.y), static_cast<float>(normal.z)}};
  }
  return pixels;
}

}  // namespace toftwin::sim
