// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/special.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "sim/tracer/cast.h"
#include "sim/tracer/hit.h"
#include "sim/tracer/path.h"
#include "sim/tracer/shade.h"

namespace toftwin::sim {
namespace {

/// Further than any scene reaches: where shadow rays to the surroundings end.
constexpr double kFarAway = 1e6;
/// What the paths carry besides a Packet.
struct Course {
  Lanes<int> model{};          ///< of the surface met: one more than its index in the scene's models; 0: matt
  Lanes<float> albedo{};       ///< of that surface
  Lanes<double> density{};     ///< of the last scattering, 1/sr; infinite from the camera and from deltas
  Lanes<double> way{};         ///< since then, through glass, m
  Lanes<int> sees_emitters{};  ///< −1 where emitters' discs are to be met: the last scattering was special
};

/// Numbers of a path's random dimensions: after those of the emitters, one for the model's choices, one for
/// the surroundings' picture, one for the sun.
struct SpecialDimensions {
  std::uint32_t emitters;
  [[nodiscard]] std::uint32_t bounce(int surface) const { return first(surface); }
  [[nodiscard]] std::uint32_t roulette(int surface) const { return first(surface) + 1; }
  [[nodiscard]] std::uint32_t emitter(int surface, std::size_t e) const {
    return first(surface) + 2 + static_cast<std::uint32_t>(e);
  }
  [[nodiscard]] std::uint32_t choice(int surface) const { return first(surface) + 2 + emitters; }
  [[nodiscard]] std::uint32_t picture(int surface) const { return first(surface) + 3 + emitters; }
  [[nodiscard]] std::uint32_t sun(int surface) const { return first(surface) + 4 + emitters; }

 private:
  [[nodiscard]] std::uint32_t first(int surface) const {
    return 1 + static_cast<std::uint32_t>(surface) * (5 + emitters);
  }
};

RandomPair drawn(const Packet& packet, std::size_t i, std::uint32_t dimension, bool is_even) {
  return is_even & packet.is_even ? randomPair(packet.key(i), packet.index[i], dimension)
                 : independentPair(packet.key(i), packet.index[i], dimension);
}

void put(Vec3d v, std::size_t i, Vec3Lanes& lanes) {
  lanes.x[i] = v.x;
  lanes.y[i] = v.y;
  lanes.z[i] = v.z;
}

/// The surface's own frame at a hit.
struct Local {
  Vec3d x, y, z, from;
  Local(const Packet& packet, const Hits& hits, std::size_t i) : z(at(hits.normal, i)) {
    const Basis basis = basisAround(z);
    x = basis.x;
    y = basis.y;
    from = into(-at(packet.direction, i));
  }
  [[nodiscard]] Vec3d into(Vec3d v) const { return {dot(v, x), dot(v, y), dot(v, z)}; }
  [[nodiscard]] Vec3d outOf(Vec3d v) const { return x * v.x + y * v.y + z * v.z; }
};

/// Veach's power heuristic: the weight of a sample of density `own` where another way has density `other`.
double heuristic(double own, double other) {
  if (std::isinf(own)) return 1.0;
  return own * own / (own * own + other * other);
}

/// Density per solid angle of drawing a place of the emitter's disc, seen at this distance and angle to its
/// axis.
double discDensity(const PlacedEmitter& emitter, double distance, double lobe_cosine) {
  return distance * distance / (emitter.area * std::max(1e-9, std::abs(lobe_cosine)));
}

/// What a hit scatters towards a direction, f · cos θ, and with which density bounce() would go there.
struct Towards {
  double value, density;
};
Towards scatteredTowards(const Tracing& tracing, const Packet& packet, const Hits& hits, const Course& course,
                         std::size_t i, Vec3d direction) {
  const Local local{packet, hits, i};
  const Vec3d to = local.into(direction);
  if (to.z <= 0.0) return {0.0, 0.0};
  const auto albedo = static_cast<double>(course.albedo[i]);
  const auto towards = [&](const auto& model) -> Towards {
    return {model.value(albedo, local.from, to) * to.z, model.density(albedo, local.from, to)};
  };
  if (course.model[i] == 0) {
    return towards(bsdf::Diffuse{static_cast<double>(hits.shape_a[i]), static_cast<double>(hits.shape_b[i])});
  }
  return std::visit(towards, tracing.scene.models[static_cast<std::size_t>(course.model[i] - 1)]);
}

/// Emitters' discs that lie on the ways of paths from special surfaces, before what they hit.
void addSeenEmitters(const Tracing& tracing, const Packet& packet, const RTCRayHit16& rays,
                     const Course& course, LaneSums& sums) {
  if (!isAny(course.sees_emitters)) return;
  for (const PlacedEmitter& emitter : tracing.emitters) {
    if (!emitter.is_disc) continue;
    DirectLight light{};
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      if ((packet.valid[i] & course.sees_emitters[i]) == 0) continue;
      const Vec3d d = at(packet.direction, i), o = at(packet.origin, i);
      const double lobe_cosine = -dot(d, emitter.axis),
                   t = -dot(emitter.position - o, emitter.axis) / lobe_cosine;
      const Vec3d beside = o + d * t - emitter.position;
      const bool is_hidden =
          rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID && t > static_cast<double>(rays.ray.tfar[i]);
      if (!(t > 0.0) || is_hidden || dot(beside, beside) > emitter.area / std::numbers::pi) continue;
      const double radiance =
          emitter.intensity(lobe_cosine) / (emitter.area * std::max(1e-9, std::abs(lobe_cosine)));
      const double weight =
          heuristic(course.density[i], discDensity(emitter, course.way[i] + t, lobe_cosine));
      light.valid[i] = radiance > 0.0 ? -1 : 0;
      light.weight[i] = static_cast<float>(static_cast<double>(packet.throughput[i]) * radiance * weight);
      light.length[i] = packet.length[i] + t + emitter.delay_m;
    }
    if (isAny(light.valid)) addLight(tracing, light, sums);
  }
}

/// Paths that met nothing end, with the surroundings' light.
void endMissed(const Tracing& tracing, const RTCRayHit16& rays, const Course& course, Packet& packet,
               LaneSums& sums) {
  const Environment* environment = tracing.scene.environment.get();
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    if (packet.valid[i] == 0 || rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID) continue;
    packet.valid[i] = 0;
    auto radiance = static_cast<double>(tracing.scene.ambient_radiance);
    if (environment != nullptr) {
      const Environment::Seen seen = environment->seen(at(packet.direction, i));
      radiance += seen.picture * heuristic(course.density[i], seen.picture_density);
      // Matt surfaces look for the sun by shadow rays alone.
      if (course.sees_emitters[i] != 0 || std::isinf(course.density[i]))
        radiance += seen.sun * heuristic(course.density[i], seen.sun_density);
    }
    sums.ambient[i] += packet.throughput[i] * static_cast<float>(radiance);
  }
}

/// Looks up what each lane met: textures, own light, and the model. Translucent surfaces become matt ones on
/// the side where the light leaves, after a way within.
void meetSurfaces(const Tracing& tracing, const RTCRayHit16& rays, int surface, Packet& packet, Hits& hits,
                  Course& course, LaneSums& sums) {
  const Scene::Impl& scene = tracing.scene;
  const SpecialDimensions dimensions{static_cast<std::uint32_t>(tracing.emitters.size())};
  applyTextures(scene, rays, packet, hits);
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    course.model[i] = 0;
    course.albedo[i] = hits.albedo[i];
    if (packet.valid[i] == 0) continue;
    sums.ambient[i] += packet.throughput[i] * hits.emission[i];
    const int special = scene.rows[rays.hit.geomID[i]].material.special;
    if (special == 0) continue;
    if (const auto* wax =
            std::get_if<bsdf::Translucent>(&scene.models[static_cast<std::size_t>(special - 1)])) {
      const RandomPair random = drawn(packet, i, dimensions.choice(surface), surface < kEvenBounces);
      packet.length[i] += wax->wayWithin(static_cast<double>(random.v));
      if (wax->goesThrough(static_cast<double>(random.u))) turnToOtherSide(hits, i);
      continue;
    }
    course.model[i] = special;
    // lightHits() then gives cos θ I / (π d²) alone.
    hits.albedo[i] = hits.shape_a[i] = 1.0f;
    hits.shape_b[i] = 0.0f;
  }
}

/// Takes the place of the matt surface that lightHits() took for granted: what the models do with light from
/// the places.
void weighByModels(const Tracing& tracing, const Packet& packet, const Hits& hits, const Course& course,
                   const PlacedEmitter& emitter, const Vec3Lanes& places, DirectLight& light) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    if (light.valid[i] == 0 || course.model[i] == 0) continue;
    const Vec3d way = at(places, i) - at(hits.position, i);
    const double distance = norm(way);
    const Towards towards = scatteredTowards(tracing, packet, hits, course, i, way / distance);
    const double cosine = dot(way, at(hits.normal, i)) / distance;
    double factor = std::numbers::pi * towards.value / cosine;
    if (emitter.is_disc) {
      const double density = discDensity(emitter, distance, -dot(way, emitter.axis) / distance);
      factor *= heuristic(density, towards.density);
    }
    light.weight[i] *= static_cast<float>(factor);
    if (!(light.weight[i] > 0.0f)) {
      light.valid[i] = 0;
      light.weight[i] = 0.0f;
    }
  }
}

/// Next-event estimation: from every hit to every emitter, with what the surface's model does with it.
void gatherDirectLight(const Tracing& tracing, const Packet& packet, const Hits& hits, const Course& course,
                       int surface, bool coherent, LaneSums& sums) {
  const SpecialDimensions dimensions{static_cast<std::uint32_t>(tracing.emitters.size())};
  for (std::size_t e = 0; e < tracing.emitters.size(); ++e) {
    const PlacedEmitter& emitter = tracing.emitters[e];
    Vec3Lanes places;
    drawPlaces(packet, emitter, dimensions.emitter(surface, e), places);
    DirectLight light;
    lightHits(packet, hits, emitter, places, light);
    weighByModels(tracing, packet, hits, course, emitter, places, light);
    if (!isAny(light.valid)) continue;
    shadowRays(tracing, hits, places, light, coherent);
    addLight(tracing, light, sums);
  }
}

/// The same to every image of a point in a flat mirror.
void gatherMirroredLight(const Tracing& tracing, const Packet& packet, const Hits& hits, const Course& course,
                         LaneSums& sums) {
  for (const MirroredEmitter& mirrored : tracing.mirrored) {
    Vec3Lanes places;
    for (std::size_t i = 0; i < kLaneCount; ++i) put(mirrored.image.position, i, places);
    DirectLight light;
    lightHits(packet, hits, mirrored.image, places, light);
    weighByModels(tracing, packet, hits, course, mirrored.image, places, light);
    if (!isAny(light.valid)) continue;
    throughMirror(tracing, packet, hits, mirrored, light);
    addLight(tracing, light, sums);
  }
}

/// The same towards the surroundings' picture or the sun.
void gatherSurroundings(const Tracing& tracing, const Packet& packet, const Hits& hits, const Course& course,
                        int surface, bool is_sun, LaneSums& sums) {
  const Environment& environment = *tracing.scene.environment;
  const SpecialDimensions dimensions{static_cast<std::uint32_t>(tracing.emitters.size())};
  const std::uint32_t dimension = is_sun ? dimensions.sun(surface) : dimensions.picture(surface);
  DirectLight light{};
  Vec3Lanes places;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    put(at(hits.position, i) + at(hits.normal, i), i, places);
    if (packet.valid[i] == 0) continue;
    const RandomPair random = drawn(packet, i, dimension, surface < kEvenBounces);
    const auto u = static_cast<double>(random.u), v = static_cast<double>(random.v);
    const Environment::Drawn drawn = is_sun ? environment.drawSun(u, v) : environment.drawPicture(u, v);
    const Towards towards = scatteredTowards(tracing, packet, hits, course, i, drawn.direction);
    if (!(towards.value > 0.0)) continue;
    const bool is_met_by_bounces = !is_sun || course.model[i] != 0;
    const double weight = is_met_by_bounces ? heuristic(drawn.density, towards.density) : 1.0;
    put(at(hits.position, i) + drawn.direction * kFarAway, i, places);
    light.valid[i] = -1;
    light.weight[i] = static_cast<float>(static_cast<double>(packet.throughput[i]) * towards.value *
                                         drawn.radiance / drawn.density * weight);
  }
  if (!isAny(light.valid)) return;
  shadowRays(tracing, hits, places, light, false);
  for (std::size_t i = 0; i < kLaneCount; ++i)
    sums.ambient[i] += light.valid[i] != 0 ? light.weight[i] : 0.0f;
}

/// Where one special lane goes on.
struct Onward {
  Vec3d direction;
  Vec3f start;
  float throughput = 0.0f;
  double length = 0.0;
};
Onward scatter(const Tracing& tracing, const Packet& packet, const Hits& hits, int surface, std::size_t i,
               Course& course) {
  const SpecialDimensions dimensions{static_cast<std::uint32_t>(tracing.emitters.size())};
  const bool is_even = surface < kEvenBounces;
  const Local local{packet, hits, i};
  const RandomPair place = drawn(packet, i, dimensions.bounce(surface), is_even);
  const RandomPair choice = drawn(packet, i, dimensions.choice(surface), is_even);
  const bsdf::Draw draw{static_cast<double>(place.u), static_cast<double>(place.v),
                        static_cast<double>(choice.u)};
  const bsdf::Any& model = tracing.scene.models[static_cast<std::size_t>(course.model[i] - 1)];
  const bsdf::Scattered on = std::visit(
      [&](const auto& m) { return m.sample(static_cast<double>(course.albedo[i]), local.from, draw); },
      model);
  Onward onward{normalised(local.outOf(on.to)),
                {hits.start.x[i], hits.start.y[i], hits.start.z[i]},
                packet.throughput[i] * static_cast<float>(on.weight),
                packet.length[i] + hits.distance[i] + on.extra_m};
  if (on.to.z < 0.0) {  // through glass: the last scattering is still the one before
    onward.start = startOnOtherSide(hits, i);
    course.way[i] += hits.distance[i];
    return onward;
  }
  course.way[i] = 0.0;
  course.density[i] = on.density;
  course.sees_emitters[i] = -1;
  return onward;
}

/// Sends all paths on: matt ones as ever, the others by their models.
void bounceAll(const Tracing& tracing, const Hits& hits, int surface, Packet& packet, Course& course) {
  const SpecialDimensions dimensions{static_cast<std::uint32_t>(tracing.emitters.size())};
  Lanes<int> is_special{};
  std::array<Onward, kLaneCount> onward;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    if (packet.valid[i] == 0 || course.model[i] == 0) continue;
    is_special[i] = -1;
    onward[i] = scatter(tracing, packet, hits, surface, i, course);
  }
  bounce(hits, dimensions.bounce(surface), surface < kEvenBounces, packet);
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    if (is_special[i] == 0) {
      course.way[i] = 0.0;
      course.density[i] = std::max(0.0, dot(at(packet.direction, i), at(hits.normal, i))) / std::numbers::pi;
      course.sees_emitters[i] = 0;
      continue;
    }
    put(onward[i].direction, i, packet.direction);
    packet.start.x[i] = onward[i].start.x;
    packet.start.y[i] = onward[i].start.y;
    packet.start.z[i] = onward[i].start.z;
    packet.throughput[i] = onward[i].throughput;
    packet.length[i] = onward[i].length;
    if (!(onward[i].throughput > 0.0f)) packet.valid[i] = 0;
  }
}

/// Where on the picture of its material a ray met an object.
TexturePlace placeOf(const BuiltObject& object, const Standing* standing, const RTCRayHit16& rays, const Hits& hits,
                     std::size_t i) {
  if (!object.places.empty()) {
    const auto& [a, b, c] = object.places[rays.hit.primID[i]];
    const float u = rays.hit.u[i], v = rays.hit.v[i], w = 1.0f - u - v;
    return {w * a.u + u * b.u + v * c.u, w * a.v + u * b.v + v * c.v};
  }
  Vec3d p = at(hits.position, i);
  if (standing != nullptr) p = (standing->scene_from_object.inverse() * Point<World>{p}).m;
  return texturePlaceOn(object.quadric, static_cast<int>(rays.hit.u[i]),
                        object.quadric.toLocal(p - object.quadric.centre));
}

}  // namespace

void shadowRays(const Tracing& tracing, const Hits& hits, const Vec3Lanes& places, DirectLight& light,
                bool coherent) {
  RTCRay16 rays;
  setShadowRays(hits, places, rays);
  if (!tracing.scene.has_glass) {
    castShadowRays(tracing.scene, light.valid.v, rays, coherent);
  } else {
    ThroughGlass through;
    castShadowRays(tracing.scene, light.valid.v, rays, coherent, through);
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      light.weight[i] *= through.share[i];
      light.length[i] += through.extra_m[i];
    }
  }
  for (std::size_t i = 0; i < kLaneCount; ++i) light.weight[i] = rays.tfar[i] < 0.0f ? 0.0f : light.weight[i];
}

void applyTextures(const Scene::Impl& scene, const RTCRayHit16& rays, const Packet& packet, Hits& hits) {
  if (scene.textures.empty()) return;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    if (packet.valid[i] == 0) continue;
    const ObjectRow& row = scene.rows[rays.hit.geomID[i]];
    const int texture = row.material.texture;
    if (texture == 0) continue;
    const BuiltObject& object = scene.objects[rays.hit.geomID[i]];
    hits.albedo[i] *= scene.textures[static_cast<std::size_t>(texture - 1)]->at(
        placeOf(object, row.standing, rays, hits, i));
  }
}

void followSpecialPaths(const Tracing& tracing, Packet& packet, LaneSums& sums) {
  const int surfaces = tracing.request.max_surfaces;
  const SpecialDimensions dimensions{static_cast<std::uint32_t>(tracing.emitters.size())};
  const Environment* environment = tracing.scene.environment.get();
  Course course;
  for (double& density : course.density.v) density = bsdf::kDelta;
  RTCRayHit16 rays;
  Hits hits;
  for (int surface = 0;; ++surface) {
    setRays(packet, rays);
    const bool is_coherent = surface == 0;
    castRays(tracing.scene, packet.valid.v, rays, is_coherent);
    addSeenEmitters(tracing, packet, rays, course, sums);
    endMissed(tracing, rays, course, packet, sums);
    if (surface == surfaces || !isAny(packet.valid)) return;
    findHits(tracing.scene, packet, rays, hits);
    meetSurfaces(tracing, rays, surface, packet, hits, course, sums);
    gatherDirectLight(tracing, packet, hits, course, surface, is_coherent, sums);
    if (surface + 2 <= surfaces)
      gatherMirroredLight(tracing, packet, hits, course, sums);  // the mirror is one more
    if (environment != nullptr && environment->hasPicture())
      gatherSurroundings(tracing, packet, hits, course, surface, false, sums);
    if (environment != nullptr && environment->hasSun())
      gatherSurroundings(tracing, packet, hits, course, surface, true, sums);
    bounceAll(tracing, hits, surface, packet, course);
    playRoulette(dimensions.roulette(surface), kRouletteThreshold, packet);
    if (!isAny(packet.valid)) return;
  }
}

}  // namespace toftwin::sim
