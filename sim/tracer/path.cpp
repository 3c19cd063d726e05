// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/path.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "sim/tracer/cast.h"
#include "sim/tracer/hit.h"
#include "sim/tracer/packet.h"
#include "sim/tracer/shade.h"
#include "sim/tracer/special.h"

namespace toftwin::sim {
namespace {

using embree::kLanes;

Dimensions dimensionsOf(const Tracing& tracing) { return {static_cast<std::uint32_t>(tracing.emitters.size())}; }

}  // namespace

void record(RayLog* log, const Lanes<int>& valid, const RTCRay16& rays, bool coherent, bool shadow) {
  if (log == nullptr) return;
  RayLog::Packet& packet = log->packets.emplace_back();
  std::copy(std::begin(valid.v), std::end(valid.v), packet.valid);
  packet.rays = rays;
  packet.is_coherent = coherent;
  packet.is_shadow = shadow;
}

void intersect(const Tracing& tracing, const Packet& packet, RTCRayHit16& rays, bool coherent) {
  setRays(packet, rays);
  record(tracing.log, packet.valid, rays.ray, coherent, false);
  castRays(tracing.scene, packet.valid.v, rays, coherent);
}

TOFTWIN_VECTOR
void endMissed(float ambient_radiance, const RTCRayHit16& rays, Packet& packet, Lanes<float>& ambient) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const bool is_missed = rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID;
    ambient[i] += is_missed & (packet.valid[i] != 0) ? packet.throughput[i] * ambient_radiance : 0.0f;
    packet.valid[i] = is_missed ? 0 : packet.valid[i];
  }
}

TOFTWIN_VECTOR
void addEmission(const Packet& packet, const Hits& hits, Lanes<float>& ambient) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    ambient[i] += packet.valid[i] != 0 ? packet.throughput[i] * hits.emission[i] : 0.0f;
  }
}

bool lookForLightOf(const Tracing& tracing, std::size_t e, const Packet& packet, const Hits& hits, int surface,
                    Vec3Lanes& places, DirectLight& light) {
  const PlacedEmitter& emitter = tracing.emitters[e];
  drawPlaces(packet, emitter, dimensionsOf(tracing).emitter(surface, e), places);
  lightHits(packet, hits, emitter, places, light);
  return isAny(light.valid);
}

void takeOffShadowed(const Tracing& tracing, const Hits& hits, const Vec3Lanes& places, bool coherent, DirectLight& light) {
  RTCRay16 rays;
  setShadowRays(hits, places, rays);
  record(tracing.log, light.valid, rays, coherent, true);
  castShadowRays(tracing.scene, light.valid.v, rays, coherent);
  for (std::size_t i = 0; i < kLaneCount; ++i) light.weight[i] = rays.tfar[i] < 0.0f ? 0.0f : light.weight[i];
}

bool findLightOf(const Tracing& tracing, std::size_t e, const Packet& packet, const Hits& hits, int surface,
                 bool coherent, Vec3Lanes& places, DirectLight& light) {
  if (!lookForLightOf(tracing, e, packet, hits, surface, places, light)) {
    light.weight = {};
    light.length = {};
    return false;
  }
  takeOffShadowed(tracing, hits, places, coherent, light);
  return true;
}

void gatherLightOf(const Tracing& tracing, std::size_t e, const Packet& packet, const Hits& hits, int surface, bool coherent,
                   Vec3Lanes& places, LaneSums& sums) {
  DirectLight light;
  if (findLightOf(tracing, e, packet, hits, surface, coherent, places, light)) addLight(tracing, light, sums);
}

void gatherDirectLight(const Tracing& tracing, const Packet& packet, const Hits& hits, int surface, bool coherent,
                       LaneSums& sums) {
  Vec3Lanes places;
  for (std::size_t e = 0; e < tracing.emitters.size(); ++e) {
    gatherLightOf(tracing, e, packet, hits, surface, coherent, places, sums);
  }
}

TOFTWIN_VECTOR
void clearSums(LaneSums& sums) {
  sums.steady = sums.ambient = {};
  for (auto* terms : {&sums.re, &sums.im}) std::fill(terms->begin(), terms->end(), Lanes<float>{});
}

void followFrom(const Tracing& tracing, int surface, Packet& packet, RTCRayHit16& rays, Hits& hits, LaneSums& sums) {
  const Dimensions dimensions = dimensionsOf(tracing);
  const int surfaces = tracing.request.max_surfaces;
  for (;; ++surface) {
    const bool is_coherent = surface == 0;
    addEmission(packet, hits, sums.ambient);
    gatherDirectLight(tracing, packet, hits, surface, is_coherent, sums);
    // Where the surroundings shine, the last surface must still look for them.
    if (surface + 1 == surfaces && tracing.scene.ambient_radiance == 0.0f) return;
    bounce(hits, dimensions.bounce(surface), surface < kEvenBounces, packet);
    playRoulette(dimensions.roulette(surface), kRouletteThreshold, packet);
    if (!isAny(packet.valid)) return;
    intersect(tracing, packet, rays, false);
    endMissed(tracing.scene.ambient_radiance, rays, packet, sums.ambient);
    if (surface + 1 == surfaces || !isAny(packet.valid)) return;
    findHits(tracing.scene, packet, rays, hits);
  }
}

namespace {

/// Follows sixteen paths over all their surfaces.
void followPaths(const Tracing& tracing, Packet& packet, LaneSums& sums) {
  RTCRayHit16 rays;
  Hits hits;
  intersect(tracing, packet, rays, true);
  endMissed(tracing.scene.ambient_radiance, rays, packet, sums.ambient);
  if (!isAny(packet.valid)) return;
  findHits(tracing.scene, packet, rays, hits);
  followFrom(tracing, 0, packet, rays, hits, sums);
}

}  // namespace

void followAll(const Tracing& tracing, Packet& packet, LaneSums& sums) {
  (tracing.scene.is_matt ? followPaths : followSpecialPaths)(tracing, packet, sums);
}

TOFTWIN_VECTOR
void preparePacket(const Tracing& tracing, const Block& block, Packet& packet) {
  const Vec3d pinhole = tracing.pinhole;
  const Vec3f start{static_cast<float>(pinhole.x), static_cast<float>(pinhole.y), static_cast<float>(pinhole.z)};
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    packet.origin.x[i] = pinhole.x;
    packet.origin.y[i] = pinhole.y;
    packet.origin.z[i] = pinhole.z;
    packet.length[i] = 0.0;
  }
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    packet.start.x[i] = start.x;
    packet.start.y[i] = start.y;
    packet.start.z[i] = start.z;
    packet.throughput[i] = 1.0f;
  }
  packet.key_a = block.key_a;
  packet.key_b = block.key_b;
  packet.is_even = tracing.request.sampler != Sampler::Plain;
}

namespace {

enum class Footprint { Middle, PlainPlaces, EvenPlaces };

/// Starts the paths of the samples from `sample` on, each at its place on its pixel or in its middle.
template <Footprint kFootprint>
TOFTWIN_INLINE void direct(const Tracing& tracing, const Block& block, int sample, int last, Packet& packet) {
  const auto [ax, ay, az] = tracing.camera_axes;
  const double extent = tracing.request.pixel_extent;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const int index = sample + block.first_sample[i];
    packet.valid[i] = (block.is_inside[i] != 0) & (index < last) ? -1 : 0;
    packet.index[i] = static_cast<std::uint32_t>(index);
    double x = block.rays.x[i], y = block.rays.y[i];
    if constexpr (kFootprint != Footprint::Middle) {
      const PixelKey key{block.key_a[i], block.key_b[i]};
      const RandomPair at = kFootprint == Footprint::PlainPlaces
                                ? independentPair(key, packet.index[i], Dimensions::kFootprint)
                                : randomPair(key, packet.index[i], Dimensions::kFootprint);
      const double du = (static_cast<double>(at.u) - 0.5) * extent, dv = (static_cast<double>(at.v) - 0.5) * extent;
      x += block.rays.x_by_u[i] * du + block.rays.x_by_v[i] * dv;
      y += block.rays.y_by_u[i] * du + block.rays.y_by_v[i] * dv;
    }
    const double per_length = perRoot(x * x + y * y + 1.0);
    packet.direction.x[i] = (ax.x * x + ay.x * y + az.x) * per_length;
    packet.direction.y[i] = (ax.y * x + ay.y * y + az.y) * per_length;
    packet.direction.z[i] = (ax.z * x + ay.z * y + az.z) * per_length;
  }
}

}  // namespace

TOFTWIN_VECTOR
void startInTheMiddle(const Tracing& tracing, const Block& block, Packet& packet) {
  direct<Footprint::Middle>(tracing, block, 0, 1, packet);
}
namespace {

TOFTWIN_VECTOR
void startAtEvenPlaces(const Tracing& tracing, const Block& block, int sample, int last, Packet& packet) {
  direct<Footprint::EvenPlaces>(tracing, block, sample, last, packet);
}
TOFTWIN_VECTOR
void startAtPlainPlaces(const Tracing& tracing, const Block& block, int sample, int last, Packet& packet) {
  direct<Footprint::PlainPlaces>(tracing, block, sample, last, packet);
}

TOFTWIN_INLINE void addLanes(const float* __restrict from, double* __restrict to) {
  for (std::size_t i = 0; i < kLaneCount; ++i) to[i] += static_cast<double>(from[i]);
}

}  // namespace

void startAtPlaces(const Tracing& tracing, const Block& block, int sample, int last, Packet& packet) {
  const auto start = packet.is_even ? startAtEvenPlaces : startAtPlainPlaces;
  start(tracing, block, sample, last, packet);
}

TOFTWIN_VECTOR
void fold(std::size_t harmonics, const Lanes<int>& started, int samples, BlockSums& sums) {
  const LaneSums& lanes = sums.of_packet;
  const double count = samples;
  const float per_count = 1.0f / static_cast<float>(samples);
  addLanes(lanes.steady.v, sums.steady.v);
  addLanes(lanes.ambient.v, sums.ambient.v);
  for (std::size_t i = 0; i < kLaneCount; ++i) sums.samples[i] += started[i] != 0 ? count : 0.0;
  for (std::size_t i = 0; i < kLaneCount; ++i) sums.batches[i] += started[i] != 0 ? 1.0 : 0.0;
  for (std::size_t term = 0; term < lanes.re.size(); ++term) {
    const Lanes<float>&re = lanes.re[term], &im = lanes.im[term];
    addLanes(re.v, sums.re[term].v);
    addLanes(im.v, sums.im[term].v);
    if (term % harmonics != 0) continue;
    Lanes<float> squares;
    for (std::size_t i = 0; i < kLaneCount; ++i) squares[i] = (re[i] * re[i] + im[i] * im[i]) * per_count;
    addLanes(squares.v, sums.squares[term / harmonics].v);
  }
}

void foldTogether(std::size_t harmonics, int samples, BlockSums& sums) {
  const LaneSums& lanes = sums.of_packet;
  const auto sumOf = [](const auto& of) { return std::accumulate(std::begin(of.v), std::end(of.v), 0.0); };
  const double count = samples;
  sums.steady[0] += sumOf(lanes.steady);
  sums.ambient[0] += sumOf(lanes.ambient);
  sums.samples[0] += count;
  sums.batches[0] += 1.0;
  for (std::size_t term = 0; term < lanes.re.size(); ++term) {
    const double re = sumOf(lanes.re[term]), im = sumOf(lanes.im[term]);
    sums.re[term][0] += re;
    sums.im[term][0] += im;
    if (term % harmonics == 0) sums.squares[term / harmonics][0] += (re * re + im * im) / count;
  }
}

TOFTWIN_VECTOR
void keepTruth(const Tracing& tracing, const Packet& packet, const Hits& hits, TruthLanes& truth) {
  const auto [ax, ay, az] = tracing.camera_axes;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
    const bool is_hit = packet.valid[i] != 0;
    const double nx = hits.normal.x[i], ny = hits.normal.y[i], nz = hits.normal.z[i];
    truth.range_m[i] = is_hit ? static_cast<float>(hits.distance[i]) : kNothing;
    truth.albedo[i] = is_hit ? hits.albedo[i] : kNothing;
    truth.normal[i].x = is_hit ? static_cast<float>(ax.x * nx + ax.y * ny + ax.z * nz) : 0.0f;
    truth.normal[i].y = is_hit ? static_cast<float>(ay.x * nx + ay.y * ny + ay.z * nz) : 0.0f;
    truth.normal[i].z = is_hit ? static_cast<float>(az.x * nx + az.y * ny + az.z * nz) : 0.0f;
  }
}

void addLight(const Tracing& tracing, const DirectLight& light, LaneSums& sums) {
  addPhasors(tracing.turns_per_metre, tracing.orders, tracing.last_orders, light.weight, light.length, sums);
  for (std::size_t g = 0; g < tracing.request.gates.size(); ++g) {
    addGates(tracing.request.gates[g], light.weight, light.length, sums.re[g], sums.im[g]);
  }
  if (!sums.bins.empty()) addToBins(tracing.bins, light, sums);
}

Tracing::Tracing(const Scene::Impl& s, const TraceRequest& r, RayLog* l, std::vector<int> o, std::vector<int> last)
    : scene(s),
      request(r),
      log(l),
      lens(r.camera),
      scene_from_camera(r.world_from_camera),
      orders(std::move(o)),
      last_orders(std::move(last)),
      seed(seedKey(r.seed)) {
  if (orders.empty()) {
    orders.resize(static_cast<std::size_t>(r.harmonics));
    std::iota(orders.begin(), orders.end(), 1);
  }
  if (last_orders.empty()) last_orders.assign(r.frequencies.size(), orders.back());
  scene_from_camera.translation_m = scene_from_camera.translation_m - scene.origin_in_world;
  pinhole = scene_from_camera.translation_m;
  camera_axes = {scene_from_camera.rotate({1, 0, 0}), scene_from_camera.rotate({0, 1, 0}), scene_from_camera.rotate({0, 0, 1})};
  for (const EmitterSpec& emitter : request.emitters) emitters.emplace_back(emitter, scene_from_camera);
  mirrored = mirroredEmitters(scene, emitters);
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
  const int samples_bits = std::countr_zero(static_cast<unsigned>(shape.samples)), samples_mask = shape.samples - 1;
  const int width_bits = std::countr_zero(static_cast<unsigned>(shape.width)), width_mask = shape.width - 1;
  const int last_column = tracing.request.camera.width - 1, last_row = tracing.request.camera.height - 1;
  const PixelKey seed = tracing.seed;
  Lanes<int> columns, rows, is_inside, first_sample;
  Lanes<std::uint32_t> key_a, key_b;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const int lane = static_cast<int>(i), pixel = lane >> samples_bits;
    columns[i] = left + (pixel & width_mask);
    rows[i] = top + (pixel >> width_bits);
    is_inside[i] = (columns[i] <= last_column) & (rows[i] <= last_row) ? -1 : 0;
    first_sample[i] = lane & samples_mask;
  }
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const PixelKey key = pixelKey(seed, static_cast<std::uint32_t>(columns[i]), static_cast<std::uint32_t>(rows[i]));
    key_a[i] = key.a;
    key_b[i] = key.b;
  }
  block.is_inside = is_inside;
  block.first_sample = first_sample;
  block.key_a = key_a;
  block.key_b = key_b;
  tracing.lens.raysOf(columns, rows, block.rays);
}

BlockSums::BlockSums(const TraceRequest& request)
    : re(request.frequencies.size() * static_cast<std::size_t>(request.harmonics) + request.gates.size()),
      im(re.size()),
      squares(request.frequencies.size() + request.gates.size()),
      of_packet(re.size()) {
  clearSums(*this);
}

TOFTWIN_VECTOR
void clearSums(BlockSums& sums) {
  sums.steady = sums.ambient = sums.samples = sums.batches = {};
  for (auto* terms : {&sums.re, &sums.im, &sums.squares}) std::fill(terms->begin(), terms->end(), Lanes<double>{});
}

TOFTWIN_VECTOR
void addSums(const BlockSums& from, BlockSums& to) {
  const auto add = [](const Lanes<double>& part, Lanes<double>& sum) {
    for (std::size_t i = 0; i < kLaneCount; ++i) sum[i] += part[i];
  };
  add(from.steady, to.steady);
  add(from.ambient, to.ambient);
  add(from.samples, to.samples);
  add(from.batches, to.batches);
  for (std::size_t i = 0; i < to.re.size(); ++i) add(from.re[i], to.re[i]);
  for (std::size_t i = 0; i < to.im.size(); ++i) add(from.im[i], to.im[i]);
  for (std::size_t i = 0; i < to.squares.size(); ++i) add(from.squares[i], to.squares[i]);
}

void traceBlock(const Tracing& tracing, const Block& block, int first, int last, BlockSums& sums) {
  const auto harmonics = static_cast<std::size_t>(tracing.request.harmonics);
  LaneSums& lanes = sums.of_packet;
  Packet packet;
  for (int sample = first; sample < last; sample += block.shape.samples) {
    preparePacket(tracing, block, packet);
    startAtPlaces(tracing, block, sample, last, packet);
    const Lanes<int> started = packet.valid;
    clearSums(lanes);
    followAll(tracing, packet, lanes);
    fold(harmonics, started, 1, sums);
  }
}

void traceOnce(const Tracing& tracing, const Block& block, LaneSums& lanes) {
  Packet packet;
  preparePacket(tracing, block, packet);
  startAtPlainPlaces(tracing, block, 0, 1, packet);
  clearSums(lanes);
  followAll(tracing, packet, lanes);
}

void traceTruth(const Tracing& tracing, const Block& block, TruthLanes& truth) {
  Packet packet;
  preparePacket(tracing, block, packet);
  startInTheMiddle(tracing, block, packet);
  RTCRayHit16 rays;
  Hits hits;
  intersect(tracing, packet, rays, true);
  Lanes<float> unused{};
  endMissed(0.0f, rays, packet, unused);
  findHits(tracing.scene, packet, rays, hits);
  applyTextures(tracing.scene, rays, packet, hits);
  keepTruth(tracing, packet, hits, truth);
  const auto step = static_cast<std::size_t>(block.shape.samples);
  for (std::size_t pixel = 1; step > 1 && pixel < kLaneCount / step; ++pixel) {
    truth.range_m[pixel] = truth.range_m[pixel * step];
    truth.albedo[pixel] = truth.albedo[pixel * step];
    truth.normal[pixel] = truth.normal[pixel * step];
  }
}

}  // namespace toftwin::sim
