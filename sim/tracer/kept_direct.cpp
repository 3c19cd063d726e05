// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/kept_direct.h"

#include <algorithm>
#include <utility>

#include "sim/tracer/hit.h"
#include "sim/tracer/shade.h"

namespace toftwin::sim {
namespace {

/// Balls around all movers, on the way to the pinhole and to each emitter.
std::vector<Shade> shadesOf(const Tracing& tracing) {
  std::vector<Shade> shades;
  const auto camera_from_scene = tracing.scene_from_camera.inverse();
  for (const Standing& standing : tracing.scene.poses) {
    const Vec3f lower = standing.lower, upper = standing.upper, middle = (lower + upper) / 2.0f;
    const Vec3d object{static_cast<double>(middle.x), static_cast<double>(middle.y), static_cast<double>(middle.z)};
    const Vec3d in_scene = (standing.scene_from_object * Point<Object>{object}).m;
    const Vec3d c = (camera_from_scene * Point<World>{in_scene}).m;
    // Wider by far more than what single precision rounds, here and in rays.
    const double radius = 1.001 * standing.radius + 1e-4 * norm(c) + standing.blur;
    const auto add = [&](Vec3d to, double by) {
      shades.push_back({static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z),
                        static_cast<float>((radius + by) * (radius + by)), static_cast<float>(to.x),
                        static_cast<float>(to.y), static_cast<float>(to.z)});
    };
    add({}, 0.0);
    for (const EmitterSpec& emitter : tracing.request.emitters) add(emitter.position_m, emitter.radius.in(metre));
  }
  return shades;
}

/// Whether a mover may lie on the way to any of the pixels, or has nothing behind it that would say so.
TOFTWIN_VECTOR
bool isNear(const BlockGeometry& pixels, const Shade& shade) {
  const Shade s = shade;
  const float mx = s.x - s.to_x, my = s.y - s.to_y, mz = s.z - s.to_z;
  int any = 0;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float dx = pixels.x[i] - s.to_x, dy = pixels.y[i] - s.to_y, dz = pixels.z[i] - s.to_z;
    const float share = (mx * dx + my * dy + mz * dz) / (dx * dx + dy * dy + dz * dz + 1e-20f);
    const float low = share > 0.0f ? share : 0.0f, t = low < 1.0f ? low : 1.0f;
    const float ax = mx - t * dx, ay = my - t * dy, az = mz - t * dz;
    any |= (ax * ax + ay * ay + az * az <= s.radius2) | !(pixels.range_m[i] > 0.0) ? 1 : 0;
  }
  return any != 0;
}

}  // namespace

void KeptDirect::prepare(const Tracing& tracing, std::size_t blocks) {
  const TraceRequest& r = tracing.request;
  shades_ = shadesOf(tracing);
  Key key{tracing.scene.id, r.camera, r.world_from_camera, r.emitters, r.seed, r.sampler};
  if (key == key_ && is_kept_.size() == blocks) return;
  key_ = std::move(key);
  is_kept_.assign(blocks, 0);
  in_images_.assign(blocks, InImages::Nothing);
  ambient_.resize(tracing.scene.is_matt ? blocks : 0);
  ways_.resize(ambient_.size() * r.emitters.size());
}

bool KeptDirect::isStill(const BlockGeometry& pixels) const {
  return std::ranges::none_of(shades_, [&](const Shade& shade) { return isNear(pixels, shade); });
}

void DirectTracer::trace(const Block& block, KeptDirect& kept, std::size_t index) {
  preparePacket(tracing_, block, packet_);
  startInTheMiddle(tracing_, block, packet_);
  if (!tracing_.scene.is_matt) {
    clearSums(sums);
    followAll(tracing_, packet_, sums);
    traceTruth(tracing_, block, truth);
    return;
  }
  intersect(tracing_, packet_, rays_, true);
  Lanes<float>& ambient = kept.ambient(index);
  ambient = {};
  endMissed(tracing_.scene.ambient_radiance, rays_, packet_, ambient);
  findHits(tracing_.scene, packet_, rays_, hits_);
  addEmission(packet_, hits_, ambient);
  for (std::size_t e = 0; e < tracing_.emitters.size(); ++e) {
    DirectLight light;
    Vec3Lanes places;
    findLightOf(tracing_, e, packet_, hits_, 0, true, places, light);
    kept.ways(index)[e] = {light.weight, light.length};
  }
  keepTruth(tracing_, packet_, hits_, truth);
}

void DirectTracer::recall(KeptDirect& kept, std::size_t index) {
  clearSums(sums);
  sums.ambient = kept.ambient(index);
  for (std::size_t e = 0; e < tracing_.emitters.size(); ++e) {
    const KeptDirect::Ways& ways = kept.ways(index)[e];
    addPhasors(tracing_.turns_per_metre, tracing_.orders, tracing_.last_orders, ways.weight, ways.length, sums);
  }
}

/// The geometry of a block's pixels in the camera's frame.
TOFTWIN_VECTOR
void keepGeometry(const Block& block, const TruthLanes& truth, BlockGeometry& pixels) {
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const bool is_hit = truth.range_m[i] > 0.0f;  // not NaN
    const double x = block.rays.x[i], y = block.rays.y[i], per_length = perRoot(x * x + y * y + 1.0);
    const float range = is_hit ? truth.range_m[i] : 0.0f, along = range * static_cast<float>(per_length);
    pixels.x[i] = along * static_cast<float>(x);
    pixels.y[i] = along * static_cast<float>(y);
    pixels.z[i] = along;
    pixels.range_m[i] = static_cast<double>(range);
    pixels.albedo[i] = is_hit ? truth.albedo[i] : 0.0f;
  }
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    pixels.normal_x[i] = truth.normal[i].x;
    pixels.normal_y[i] = truth.normal[i].y;
    pixels.normal_z[i] = truth.normal[i].z;
  }
}

}  // namespace toftwin::sim
