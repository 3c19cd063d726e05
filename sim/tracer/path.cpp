// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/path.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "sim/tracer/hit.h"
#include "sim/tracer/lens.h"
#include "sim/tracer/phasor.h"
#include "sim/tracer/random.h"

namespace toftwin::sim {
namespace {

using embree::kLanes;
constexpr auto kLaneCount = static_cast<std::size_t>(kLanes);

/// Below this throughput a path survives by chance and is weighted up. Unbiased; with it, a path of
/// albedo 0.8 is followed for ten surfaces before the first draw.
constexpr float kRouletteThreshold = 0.1f;

/// Sixteen paths on their way; lane i of each array belongs to path i.
struct Packet {
  alignas(64) std::array<int, kLaneCount> valid{};  ///< −1 while the path goes on
  std::array<Vec3d, kLaneCount> origin{};           ///< exact: the pinhole or a place on a surface
  std::array<Vec3f, kLaneCount> ray_origin{};       ///< what Embree gets
  std::array<Vec3d, kLaneCount> direction{};
  std::array<double, kLaneCount> length{};          ///< from the pinhole to `origin`
  std::array<float, kLaneCount> throughput{};
  std::array<PathRandom, kLaneCount> random{};
  std::array<int, kLaneCount> pixel{};              ///< within the block; −1: lane not in use

  [[nodiscard]] bool isAnyAlive() const {
    return std::any_of(valid.begin(), valid.end(), [](int v) { return v != 0; });
  }
};

/// What one packet of paths brought back, per lane.
struct LaneSums {
  explicit LaneSums(std::size_t terms) : re(terms), im(terms) {}
  using Lanes = std::array<float, kLaneCount>;
  Lanes steady{}, ambient{};
  std::vector<Lanes> re, im;  ///< [frequency][harmonic]
};

/// Numbers of a path's dimensions.
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

void setRay(RTCRay16& ray, std::size_t lane, Vec3f origin, Vec3d direction, float far) {
  ray.org_x[lane] = origin.x;
  ray.org_y[lane] = origin.y;
  ray.org_z[lane] = origin.z;
  ray.tnear[lane] = 0.0f;
  ray.dir_x[lane] = static_cast<float>(direction.x);
  ray.dir_y[lane] = static_cast<float>(direction.y);
  ray.dir_z[lane] = static_cast<float>(direction.z);
  ray.time[lane] = 0.0f;
  ray.tfar[lane] = far;
  ray.mask[lane] = 0xffffffffu;
  ray.id[lane] = 0;
  ray.flags[lane] = 0;
}

void record(RayLog* log, const std::array<int, kLaneCount>& valid, const RTCRay16& rays, bool coherent,
            bool shadow) {
  if (log == nullptr) return;
  RayLog::Packet& packet = log->packets.emplace_back();
  std::copy(valid.begin(), valid.end(), packet.valid);
  packet.rays = rays;
  packet.is_coherent = coherent;
  packet.is_shadow = shadow;
}

/// Finds where each living path goes; lanes that meet nothing get no geometry id.
void intersect(const Tracing& tracing, const Packet& packet, RTCRayHit16& rays, bool coherent) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    setRay(rays.ray, i, packet.ray_origin[i], packet.direction[i], std::numeric_limits<float>::infinity());
    rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  record(tracing.log, packet.valid, rays.ray, coherent, false);
  embree::intersect(packet.valid.data(), tracing.scene.embree, rays, coherent);
}

/// Adds w · exp(−i 2π n f L/c) for every frequency and harmonic, lane by lane.
void addPhasors(const Tracing& tracing, const std::array<float, kLaneCount>& weight,
                const std::array<double, kLaneCount>& length, LaneSums& sums) {
  const int harmonics = tracing.request.harmonics;
  for (std::size_t i = 0; i < kLaneCount; ++i) sums.steady[i] += weight[i];
  for (std::size_t f = 0; f < tracing.turns_per_metre.size(); ++f) {
    const double turns_per_metre = tracing.turns_per_metre[f];
    LaneSums::Lanes cosine, sine, re, im;
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const CosSin z = cosSinOfTurns(length[i] * turns_per_metre);
      cosine[i] = z.cos;
      sine[i] = -z.sin;
      re[i] = weight[i] * cosine[i];
      im[i] = weight[i] * sine[i];
    }
    for (int n = 0; n < harmonics; ++n) {
      const std::size_t term = f * static_cast<std::size_t>(harmonics) + static_cast<std::size_t>(n);
      for (std::size_t i = 0; i < kLaneCount; ++i) {
        sums.re[term][i] += re[i];
        sums.im[term][i] += im[i];
        const float next = re[i] * cosine[i] - im[i] * sine[i];
        im[i] = re[i] * sine[i] + im[i] * cosine[i];
        re[i] = next;
      }
    }
  }
}

using Hits = std::array<Hit, kLaneCount>;

/// Next-event estimation: from every hit to every emitter.
///   w = throughput · albedo/π · shape · cos θ · I(γ) / d²
void gatherDirectLight(const Tracing& tracing, const Packet& packet, const Hits& hits, int surface,
                       bool coherent, LaneSums& sums) {
  const Dimensions dimensions{tracing.emitters.size()};
  for (std::size_t e = 0; e < tracing.emitters.size(); ++e) {
    const PlacedEmitter& emitter = tracing.emitters[e];
    alignas(64) std::array<int, kLaneCount> valid{};
    std::array<float, kLaneCount> weight{};
    std::array<double, kLaneCount> length{};
    RTCRay16 rays;
    bool is_any = false;
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      setRay(rays, i, {}, {0, 0, 1}, 0.0f);
      if (packet.valid[i] == 0) continue;
      const Hit& hit = hits[i];
      Vec3d light = emitter.position;
      if (emitter.is_disc) {
        const auto [u, v] = packet.random[i].pair(dimensions.emitter(surface, e));
        light = emitter.place(u, v);
      }
      const Vec3d to_light = light - hit.position;
      const double distance2 = dot(to_light, to_light), distance = std::sqrt(distance2);
      const Vec3d direction = to_light / distance;
      const double cosine = dot(direction, hit.normal);
      const double intensity = emitter.intensity(-direction);
      if (!(cosine > 0.0 && intensity > 0.0)) continue;  // false for NaN too
      const Material& material = tracing.scene.materials[hit.material];
      const double reflected = static_cast<double>(material.albedo *
                               reflectionShape(material, direction, -packet.direction[i], hit.normal)) / std::numbers::pi;
      weight[i] = static_cast<float>(static_cast<double>(packet.throughput[i]) * reflected * cosine * intensity / distance2);
      length[i] = packet.length[i] + hit.distance + distance;
      const Vec3f from = hit.start;
      const Vec3d way = light - Vec3d{static_cast<double>(from.x), static_cast<double>(from.y), static_cast<double>(from.z)};
      const double way_length = norm(way);
      // Rounding of origin and direction moves the ray's end by less than four units in the last place.
      setRay(rays, i, from, way / way_length, static_cast<float>(way_length * (1.0 - 0x1p-22)));
      valid[i] = -1;
      is_any = true;
    }
    if (!is_any) continue;
    record(tracing.log, valid, rays, coherent, true);
    embree::occluded(valid.data(), tracing.scene.embree, rays, coherent);
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      if (rays.tfar[i] < 0.0f) weight[i] = 0.0f;
    }
    addPhasors(tracing, weight, length, sums);
  }
}

/// Sends a living path on from its hit: cosine-weighted, so that a Lambertian surface costs its albedo.
void bounce(const Tracing& tracing, Packet& packet, std::size_t i, const Hit& hit, int surface) {
  const Dimensions dimensions{tracing.emitters.size()};
  const auto [u, v] = packet.random[i].pair(dimensions.bounce(surface));
  const CosSin around = cosSinOfTurns(v);
  const double r = std::sqrt(u);
  const double x = r * static_cast<double>(around.cos), y = r * static_cast<double>(around.sin);
  const double z = std::sqrt(std::max(1e-12, 1.0 - x * x - y * y));
  const Basis basis = basisAround(hit.normal);
  const Vec3d direction = basis.x * x + basis.y * y + hit.normal * z;
  const Material& material = tracing.scene.materials[hit.material];
  packet.throughput[i] *= material.albedo * reflectionShape(material, direction, -packet.direction[i], hit.normal);
  packet.length[i] += hit.distance;
  packet.origin[i] = hit.position;
  packet.ray_origin[i] = hit.start;
  packet.direction[i] = direction;
  float& throughput = packet.throughput[i];
  if (throughput < kRouletteThreshold) {
    const float survival = throughput / kRouletteThreshold;
    const auto [draw, unused] = packet.random[i].pair(dimensions.roulette(surface));
    throughput = kRouletteThreshold;
    if (!(draw < static_cast<double>(survival))) packet.valid[i] = 0;
  }
}

/// Follows sixteen paths over all their surfaces.
void followPaths(const Tracing& tracing, Packet& packet, LaneSums& sums) {
  const int surfaces = tracing.request.max_surfaces;
  // Where the surroundings shine, the last surface must still look for them.
  const int segments = surfaces + (tracing.scene.ambient_radiance > 0.0f ? 1 : 0);
  for (int surface = 0; surface < segments && packet.isAnyAlive(); ++surface) {
    const bool is_coherent = surface == 0;
    RTCRayHit16 rays;
    intersect(tracing, packet, rays, is_coherent);
    Hits hits;
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      if (packet.valid[i] == 0) continue;
      if (rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) {
        sums.ambient[i] += packet.throughput[i] * tracing.scene.ambient_radiance;
        packet.valid[i] = 0;
        continue;
      }
      if (surface == surfaces) {
        packet.valid[i] = 0;
        continue;
      }
      hits[i] = refine(tracing.scene, rays.hit.geomID[i], rays.hit.primID[i], rays.hit.u[i], rays.hit.v[i],
                       rays.ray.tfar[i], packet.origin[i], packet.direction[i]);
      sums.ambient[i] += packet.throughput[i] * tracing.scene.materials[hits[i].material].emission;
    }
    if (surface == surfaces || !packet.isAnyAlive()) break;
    gatherDirectLight(tracing, packet, hits, surface, is_coherent, sums);
    if (surface + 1 == segments) break;
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      if (packet.valid[i] != 0) bounce(tracing, packet, i, hits[i], surface);
    }
  }
}

/// Puts a path's start into a lane.
void start(const Tracing& tracing, Packet& packet, std::size_t lane, Vec3d direction_in_camera) {
  packet.valid[lane] = -1;
  packet.origin[lane] = tracing.pinhole;
  packet.ray_origin[lane] = {static_cast<float>(tracing.pinhole.x), static_cast<float>(tracing.pinhole.y),
                             static_cast<float>(tracing.pinhole.z)};
  packet.direction[lane] = tracing.scene_from_camera.rotate(direction_in_camera);
  packet.length[lane] = 0.0;
  packet.throughput[lane] = 1.0f;
}

/// The lanes' sums go to their pixels, and their squares to the variance.
void fold(const Tracing& tracing, const Packet& packet, const LaneSums& lanes, BlockSums& sums) {
  const auto harmonics = static_cast<std::size_t>(tracing.request.harmonics);
  const std::size_t frequencies = tracing.turns_per_metre.size(), terms = frequencies * harmonics;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    if (packet.pixel[i] < 0) continue;
    const auto p = static_cast<std::size_t>(packet.pixel[i]);
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

void traceBlock(const Tracing& tracing, const BlockShape& shape, int x, int y, int first, int last,
                BlockSums& sums) {
  const TraceRequest& request = tracing.request;
  std::array<PixelRays, kLaneCount> rays;
  for (int p = 0; p < shape.pixels(); ++p) {
    rays[static_cast<std::size_t>(p)] = raysOfPixel(request.camera, x + p % shape.width, y + p / shape.width);
  }
  const std::size_t terms = tracing.turns_per_metre.size() * static_cast<std::size_t>(request.harmonics);
  for (int sample = first; sample < last; sample += shape.samples) {
    Packet packet;
    LaneSums lanes{terms};
    for (int lane = 0; lane < kLanes; ++lane) {
      const auto i = static_cast<std::size_t>(lane);
      const int p = lane / shape.samples, index = sample + lane % shape.samples;
      const int u = x + p % shape.width, v = y + p / shape.width;
      packet.pixel[i] = -1;
      if (index >= last || u >= request.camera.width || v >= request.camera.height) continue;
      packet.pixel[i] = p;
      packet.random[i] = PathRandom{request.seed,
                                    static_cast<std::uint64_t>(v) << 32 | static_cast<std::uint32_t>(u),
                                    static_cast<std::uint64_t>(index)};
      const auto [du, dv] = packet.random[i].pair(Dimensions::kFootprint);
      start(tracing, packet, i,
            rays[static_cast<std::size_t>(p)].direction((du - 0.5) * request.pixel_extent,
                                                        (dv - 0.5) * request.pixel_extent));
    }
    followPaths(tracing, packet, lanes);
    fold(tracing, packet, lanes, sums);
  }
}

void traceTruth(const Tracing& tracing, const BlockShape& shape, int x, int y, TruthPixel* pixels) {
  const CameraInfo& camera = tracing.request.camera;
  Packet packet;
  for (int p = 0; p < shape.pixels(); ++p) {
    const int u = x + p % shape.width, v = y + p / shape.width;
    if (u >= camera.width || v >= camera.height) continue;
    start(tracing, packet, static_cast<std::size_t>(p), raysOfPixel(camera, u, v).direction(0.0, 0.0));
  }
  RTCRayHit16 rays;
  intersect(tracing, packet, rays, true);
  const Transform<Camera, World> camera_from_scene = tracing.scene_from_camera.inverse();
  for (std::size_t i = 0; i < static_cast<std::size_t>(shape.pixels()); ++i) {
    constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
    pixels[i] = {.range_m = kNothing, .albedo = kNothing, .normal = {}};
    if (packet.valid[i] == 0 || rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
    const Hit hit = refine(tracing.scene, rays.hit.geomID[i], rays.hit.primID[i], rays.hit.u[i], rays.hit.v[i],
                           rays.ray.tfar[i], packet.origin[i], packet.direction[i]);
    const Vec3d normal = camera_from_scene.rotate(hit.normal);
    pixels[i] = {.range_m = static_cast<float>(hit.distance),
                 .albedo = tracing.scene.materials[hit.material].albedo,
                 .normal = {static_cast<float>(normal.x), static_cast<float>(normal.y), static_cast<float>(normal.z)}};
  }
}

}  // namespace toftwin::sim
