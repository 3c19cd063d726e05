// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/kept_direct.h"

#include <algorithm>
#include <cmath>
#include <limits>
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
    const Vec3d c = (camera_from_scene * Point<World>{standing.middle()}).m;
    // Wider by far more than what single precision rounds, here and in rays.
    const double radius = 1.001 * standing.radius + 1e-4 * norm(c) + standing.blur;
    const auto add = [&](Vec3d to, double by) {
      shades.push_back({static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z),
                        static_cast<float>(radius + by), static_cast<float>(to.x), static_cast<float>(to.y),
                        static_cast<float>(to.z)});
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
  const float mx = s.x - s.to_x, my = s.y - s.to_y, mz = s.z - s.to_z, radius2 = s.radius * s.radius;
  int any = 0;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float dx = pixels.x[i] - s.to_x, dy = pixels.y[i] - s.to_y, dz = pixels.z[i] - s.to_z;
    const float share = (mx * dx + my * dy + mz * dz) / (dx * dx + dy * dy + dz * dz + 1e-20f);
    const float low = share > 0.0f ? share : 0.0f, t = low < 1.0f ? low : 1.0f;
    const float ax = mx - t * dx, ay = my - t * dy, az = mz - t * dz;
    any |= (ax * ax + ay * ay + az * az <= radius2) | !(pixels.z[i] > 0.0f) ? 1 : 0;
  }
  return any != 0;
}

/// The same of all that lies in the ball: ways from one point into it keep within its radius of the way to its middle.
bool isNear(const Ball& ball, const Shade& s) {
  const float mx = s.x - s.to_x, my = s.y - s.to_y, mz = s.z - s.to_z, radius = s.radius + ball.radius;
  const float dx = ball.x - s.to_x, dy = ball.y - s.to_y, dz = ball.z - s.to_z;
  const float t = std::clamp((mx * dx + my * dy + mz * dz) / (dx * dx + dy * dy + dz * dz + 1e-20f), 0.0f, 1.0f);
  const float ax = mx - t * dx, ay = my - t * dy, az = mz - t * dz;
  return ax * ax + ay * ay + az * az <= radius * radius;
}

TOFTWIN_VECTOR
Ball ballAround(const BlockGeometry& pixels) {
  float x = 0.0f, y = 0.0f, z = 0.0f, square = 0.0f;
  int is_any_nowhere = 0;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    x += pixels.x[i];
    y += pixels.y[i];
    z += pixels.z[i];
    is_any_nowhere |= !(pixels.z[i] > 0.0f) ? 1 : 0;
  }
  x /= kLaneCount, y /= kLaneCount, z /= kLaneCount;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    const float dx = pixels.x[i] - x, dy = pixels.y[i] - y, dz = pixels.z[i] - z;
    square = std::max(square, dx * dx + dy * dy + dz * dz);
  }
  // Wider than rounding moves it.
  const float radius = 1.001f * std::sqrt(square) + 1e-5f * std::sqrt(x * x + y * y + z * z);
  return {x, y, z, is_any_nowhere != 0 ? std::numeric_limits<float>::infinity() : radius};
}

}  // namespace

void KeptDirect::prepare(const Tracing& tracing) {
  const TraceRequest& r = tracing.request;
  ++frame_;
  keeps_ = tracing.scene.is_matt;
  shades_ = shadesOf(tracing);
  Key key{tracing.scene.id, r.camera, r.world_from_camera, r.emitters, r.seed, r.sampler};
  if (key == key_) return;
  key_ = std::move(key);
  const auto along = [](int pixels) { return (pixels + CoarseGrid::kStep - 1) / CoarseGrid::kStep; };
  columns_ = along(r.camera.width);
  rows_ = along(r.camera.height);
  const auto blocks = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  is_kept_.assign(blocks, 0);
  in_images_.assign(blocks, InImages::Nothing);
  balls_.resize(blocks);
  traced_in_.resize(blocks);
  ambient_.resize(keeps_ ? blocks : 0);
  ways_.resize(ambient_.size() * r.emitters.size());
  points_.resize(ambient_.size());
}

bool KeptDirect::find(int i, int j, SeenTile& tile) const {
  // The grid's last row and column lie on last pixels.
  if (!keeps_ || i + 4 > columns_ || j + 4 > rows_) return false;
  for (std::size_t lane = 0; lane < kLaneCount; ++lane) {
    const auto l = static_cast<int>(lane);
    const Point& point = points_[static_cast<std::size_t>((j + l / 4) * columns_ + i + l % 4)];
    tile.valid[lane] = point.is_hit ? -1 : 0;
    tile.mover[lane] = point.mover;
    tile.position.x[lane] = point.position.x;
    tile.position.y[lane] = point.position.y;
    tile.position.z[lane] = point.position.z;
    tile.normal.x[lane] = point.normal.x;
    tile.normal.y[lane] = point.normal.y;
    tile.normal.z[lane] = point.normal.z;
    tile.start.x[lane] = point.start.x;
    tile.start.y[lane] = point.start.y;
    tile.start.z[lane] = point.start.z;
  }
  return true;
}

bool KeptDirect::isStill(std::size_t block, const BlockGeometry& pixels) const {
  return std::ranges::none_of(shades_, [&](const Shade& shade) {
    return isNear(balls_[block], shade) && isNear(pixels, shade);
  });
}

bool KeptDirect::goesOn(std::size_t block, const BlockGeometry& pixels) const {
  return is_kept_[block] != 0 && isStill(block, pixels);
}

void KeptDirect::keep(std::size_t block, const BlockGeometry& pixels) {
  balls_[block] = ballAround(pixels);
  traced_in_[block] = frame_;
  is_kept_[block] = keeps_ && isStill(block, pixels) ? 1 : 0;
  in_images_[block] = InImages::Nothing;
}

std::uint32_t KeptDirect::newest(int left, int top, int right, int bottom) const {
  std::uint32_t newest = 0;
  for (int v = top; v <= std::min(bottom, rows_ - 1); ++v) {
    for (int u = left; u <= std::min(right, columns_ - 1); ++u)
      newest = std::max(newest, traced_in_[static_cast<std::size_t>(v * columns_ + u)]);
  }
  return newest;
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
  const bool is_hit = packet_.valid[0] != 0;
  kept.point(index) = {is_hit,
                       is_hit ? tracing_.scene.moverOf(rays_.hit.geomID[0]) : 0,
                       at(hits_.position, 0),
                       at(hits_.normal, 0),
                       {hits_.start.x[0], hits_.start.y[0], hits_.start.z[0]}};
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
  }
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    pixels.normal_x[i] = truth.normal[i].x;
    pixels.normal_y[i] = truth.normal[i].y;
    pixels.normal_z[i] = truth.normal[i].z;
  }
}

}  // namespace toftwin::sim
