// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/path.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "sim/tracer/hit.h"
#include "sim/tracer/packet.h"
#include "sim/tracer/shade.h"

namespace toftwin::sim {
namespace {

using embree::kLanes;

/// Below this throughput a path survives by chance and is weighted up. Unbiased; with it, a path of
/// albedo 0.8 is followed for ten surfaces before the first draw.
constexpr float kRouletteThreshold = 0.1f;

/// So many bounces of a pixel's samples are spread evenly over all directions.
constexpr int kEvenBounces = 2;

/// Numbers of a path's random dimensions.
struct Dimensions {
  std::uint32_t emitters;
  static constexpr std::uint32_t kFootprint = 0;
  [[nodiscard]] std::uint32_t bounce(int surface) const { return first(surface); }
  [[nodiscard]] std::uint32_t roulette(int surface) const { return first(surface) + 1; }
  [[nodiscard]] std::uint32_t emitter(int surface, std::size_t e) const {
    return first(surface) + 2 + static_cast<std::uint32_t>(e);
  }

 private:
  [[nodiscard]] std::uint32_t first(int surface) const { return 1 + static_cast<std::uint32_t>(surface) * (2 + emitters); }
};

Dimensions dimensionsOf(const Tracing& tracing) { return {static_cast<std::uint32_t>(tracing.emitters.size())}; }

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

/// Paths that met nothing end, with the surroundings' light.
TOFTWIN_VECTOR
void endMissed(float ambient_radiance, const RTCRayHit16& rays, Packet& packet, Lanes<float>& ambient) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const bool is_missed = rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID;
    ambient[i] += is_missed & (packet.valid[i] != 0) ? packet.throughput[i] * ambient_radiance : 0.0f;
    packet.valid[i] = is_missed ? 0 : packet.valid[i];
  }
}

/// Light of the surfaces themselves.
TOFTWIN_VECTOR
void addEmission(const Packet& packet, const Hits& hits, Lanes<float>& ambient) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    ambient[i] += packet.valid[i] != 0 ? packet.throughput[i] * hits.emission[i] : 0.0f;
  }
}

/// Next-event estimation: from every hit to every emitter.
void gatherDirectLight(const Tracing& tracing, const Packet& packet, const Hits& hits, int surface, bool coherent,
                       LaneSums& sums) {
  for (std::size_t e = 0; e < tracing.emitters.size(); ++e) {
    const PlacedEmitter& emitter = tracing.emitters[e];
    Vec3Lanes places;
    drawPlaces(packet, emitter, dimensionsOf(tracing).emitter(surface, e), places);
    DirectLight light;
    lightHits(packet, hits, emitter, places, light);
    if (!isAny(light.valid)) continue;
    RTCRay16 rays;
    setShadowRays(hits, places, rays);
    record(tracing.log, light.valid, rays, coherent, true);
    embree::occluded(light.valid.v, tracing.scene.embree, rays, coherent);
    for (std::size_t i = 0; i < kLaneCount; ++i) light.weight[i] = rays.tfar[i] < 0.0f ? 0.0f : light.weight[i];
    addPhasors(tracing.turns_per_metre, tracing.request.harmonics, light.weight, light.length, sums);
  }
}

/// Follows sixteen paths over all their surfaces.
void followPaths(const Tracing& tracing, Packet& packet, LaneSums& sums) {
  const Dimensions dimensions = dimensionsOf(tracing);
  const int surfaces = tracing.request.max_surfaces;
  RTCRayHit16 rays;
  Hits hits;
  for (int surface = 0;; ++surface) {
    const bool is_coherent = surface == 0;
    intersect(tracing, packet, rays, is_coherent);
    endMissed(tracing.scene.ambient_radiance, rays, packet, sums.ambient);
    if (surface == surfaces || !isAny(packet.valid)) return;
    findHits(tracing.scene, packet, rays, hits);
    addEmission(packet, hits, sums.ambient);
    gatherDirectLight(tracing, packet, hits, surface, is_coherent, sums);
    // Where the surroundings shine, the last surface must still look for them.
    if (surface + 1 == surfaces && tracing.scene.ambient_radiance == 0.0f) return;
    bounce(hits, dimensions.bounce(surface), surface < kEvenBounces, packet);
    playRoulette(dimensions.roulette(surface), kRouletteThreshold, packet);
    if (!isAny(packet.valid)) return;
  }
}

/// Starts the paths of the samples from `sample` on, each at its place on its pixel; `extent` 0: in the
/// middle.
TOFTWIN_VECTOR
void startPaths(const Tracing& tracing, const Block& block, int sample, int last, double extent, Packet& packet) {
  const auto [ax, ay, az] = tracing.camera_axes;
  const Vec3d pinhole = tracing.pinhole;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const int index = sample + block.first_sample[i];
    packet.valid[i] = (block.is_inside[i] != 0) & (index < last) ? -1 : 0;
    packet.index[i] = static_cast<std::uint32_t>(index);
    const RandomPair at = randomPair({block.key_a[i], block.key_b[i]}, packet.index[i], Dimensions::kFootprint);
    const double du = (static_cast<double>(at.u) - 0.5) * extent, dv = (static_cast<double>(at.v) - 0.5) * extent;
    const double x = block.rays.x[i] + block.rays.x_by_u[i] * du + block.rays.x_by_v[i] * dv;
    const double y = block.rays.y[i] + block.rays.y_by_u[i] * du + block.rays.y_by_v[i] * dv;
    const double per_length = 1.0 / std::sqrt(x * x + y * y + 1.0);
    packet.direction.x[i] = (ax.x * x + ay.x * y + az.x) * per_length;
    packet.direction.y[i] = (ax.y * x + ay.y * y + az.y) * per_length;
    packet.direction.z[i] = (ax.z * x + ay.z * y + az.z) * per_length;
  }
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    packet.origin.x[i] = pinhole.x;
    packet.origin.y[i] = pinhole.y;
    packet.origin.z[i] = pinhole.z;
    packet.start.x[i] = static_cast<float>(pinhole.x);
    packet.start.y[i] = static_cast<float>(pinhole.y);
    packet.start.z[i] = static_cast<float>(pinhole.z);
    packet.length[i] = 0.0;
    packet.throughput[i] = 1.0f;
  }
  packet.key_a = block.key_a;
  packet.key_b = block.key_b;
}

/// The lanes' sums of one packet go to those of all, and their squares to the variance.
TOFTWIN_VECTOR
void fold(std::size_t harmonics, const Lanes<int>& started, BlockSums& sums) {
  const LaneSums& lanes = sums.of_packet;
#pragma GCC ivdep
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    sums.steady[i] += static_cast<double>(lanes.steady[i]);
    sums.ambient[i] += static_cast<double>(lanes.ambient[i]);
    sums.samples[i] += started[i] != 0 ? 1.0 : 0.0;
  }
  for (std::size_t term = 0; term < lanes.re.size(); ++term) {
    const Lanes<float>&re = lanes.re[term], &im = lanes.im[term];
    Lanes<double>&sum_re = sums.re[term], &sum_im = sums.im[term];
#pragma GCC ivdep
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      sum_re[i] += static_cast<double>(re[i]);
      sum_im[i] += static_cast<double>(im[i]);
    }
    if (term % harmonics != 0) continue;
    Lanes<double>& squares = sums.squares[term / harmonics];
#pragma GCC ivdep
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const auto a = static_cast<double>(re[i]), b = static_cast<double>(im[i]);
      squares[i] += a * a + b * b;
    }
  }
}

template <class Change>
void forEachLanes(BlockSums& sums, const Change& change) {
  change(sums.steady);
  change(sums.ambient);
  change(sums.samples);
  for (auto* terms : {&sums.re, &sums.im, &sums.squares}) std::for_each(terms->begin(), terms->end(), change);
}

}  // namespace

Tracing::Tracing(const Scene::Impl& s, const TraceRequest& r, RayLog* l)
    : scene(s), request(r), log(l), scene_from_camera(r.world_from_camera), seed(seedKey(r.seed)) {
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

TOFTWIN_VECTOR
void prepareBlock(const Tracing& tracing, const BlockShape& shape, int left, int top, Block& block) {
  block.shape = shape;
  block.x = left;
  block.y = top;
  const CameraInfo& camera = tracing.request.camera;
  const auto log2 = [](int n) { return std::countr_zero(static_cast<unsigned>(n)); };
  const int samples_bits = log2(shape.samples), width_bits = log2(shape.width);
  const int last_column = camera.width - 1, last_row = camera.height - 1;
  const PixelKey seed = tracing.seed;
  Lanes<int> columns, rows;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const int lane = static_cast<int>(i), pixel = lane >> samples_bits;
    const int u = left + (pixel & (shape.width - 1)), v = top + (pixel >> width_bits);
    block.is_inside[i] = (u <= last_column) & (v <= last_row) ? -1 : 0;
    block.first_sample[i] = lane & (shape.samples - 1);
    const PixelKey key = pixelKey(seed, static_cast<std::uint32_t>(u), static_cast<std::uint32_t>(v));
    block.key_a[i] = key.a;
    block.key_b[i] = key.b;
    columns[i] = u;
    rows[i] = v;
  }
  raysOfPixels(camera, columns, rows, block.rays);
}

BlockSums::BlockSums(const TraceRequest& request)
    : re(request.frequencies.size() * static_cast<std::size_t>(request.harmonics)),
      im(re.size()),
      squares(request.frequencies.size()),
      of_packet(re.size()) {
  clear();
}

void BlockSums::clear() {
  forEachLanes(*this, [](Lanes<double>& lanes) { lanes = {}; });
}

BlockSums& BlockSums::operator+=(const BlockSums& other) {
  const auto add = [](Lanes<double>& to, const Lanes<double>& from) {
    for (std::size_t i = 0; i < kLaneCount; ++i) to[i] += from[i];
  };
  add(steady, other.steady);
  add(ambient, other.ambient);
  add(samples, other.samples);
  for (std::size_t i = 0; i < re.size(); ++i) add(re[i], other.re[i]);
  for (std::size_t i = 0; i < im.size(); ++i) add(im[i], other.im[i]);
  for (std::size_t i = 0; i < squares.size(); ++i) add(squares[i], other.squares[i]);
  return *this;
}

void BlockSums::gather(const BlockShape& shape) {
  forEachLanes(*this, [step = static_cast<std::size_t>(shape.samples)](Lanes<double>& lanes) {
    for (std::size_t width = 1; width < step; width *= 2) {
      for (std::size_t i = 0; i < kLaneCount; i += 2 * width) lanes[i] += lanes[i + width];
    }
  });
}

void traceBlock(const Tracing& tracing, const Block& block, int first, int last, BlockSums& sums) {
  const TraceRequest& request = tracing.request;
  const auto harmonics = static_cast<std::size_t>(request.harmonics);
  LaneSums& lanes = sums.of_packet;
  Packet packet;
  for (int sample = first; sample < last; sample += block.shape.samples) {
    startPaths(tracing, block, sample, last, request.pixel_extent, packet);
    const Lanes<int> started = packet.valid;
    lanes.clear();
    followPaths(tracing, packet, lanes);
    fold(harmonics, started, sums);
  }
}

void traceTruth(const Tracing& tracing, const Block& block, TruthLanes& truth) {
  Packet packet;
  startPaths(tracing, block, 0, 1, 0.0, packet);
  RTCRayHit16 rays;
  Hits hits;
  intersect(tracing, packet, rays, true);
  Lanes<float> unused{};
  endMissed(0.0f, rays, packet, unused);
  findHits(tracing.scene, packet, rays, hits);
  const auto [ax, ay, az] = tracing.camera_axes;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
    const bool is_hit = packet.valid[i] != 0;
    const double nx = hits.normal.x[i], ny = hits.normal.y[i], nz = hits.normal.z[i];
    truth.range_m[i] = is_hit ? static_cast<float>(hits.distance[i]) : kNothing;
    truth.albedo[i] = is_hit ? hits.albedo[i] : kNothing;
    truth.normal.x[i] = is_hit ? static_cast<float>(ax.x * nx + ax.y * ny + ax.z * nz) : 0.0f;
    truth.normal.y[i] = is_hit ? static_cast<float>(ay.x * nx + ay.y * ny + ay.z * nz) : 0.0f;
    truth.normal.z[i] = is_hit ? static_cast<float>(az.x * nx + az.y * ny + az.z * nz) : 0.0f;
  }
}

}  // namespace toftwin::sim
