// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/objects.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "sim/tracer/cast.h"

namespace toftwin::sim {
namespace {

/// Rays of up to sixteen neighbouring pixels of a row, from the pinhole; lanes beyond the row's end are off.
struct RowRays {
  alignas(64) int valid[embree::kLanes];
  RTCRayHit16 rays;
};

void setRays(const CameraInfo& camera, const Transform<World, Camera>& scene_from_camera, int x, int y,
             RowRays& row) {
  for (int i = 0; i < embree::kLanes; ++i) {
    const auto lane = static_cast<std::size_t>(i);
    row.valid[lane] = x + i < camera.width ? -1 : 0;
    const Direction<World> ray =
        scene_from_camera * rayThroughPixel(camera, std::min(x + i, camera.width - 1), y);
    const Vec3d start = scene_from_camera.translation_m;
    row.rays.ray.org_x[lane] = static_cast<float>(start.x);
    row.rays.ray.org_y[lane] = static_cast<float>(start.y);
    row.rays.ray.org_z[lane] = static_cast<float>(start.z);
    row.rays.ray.dir_x[lane] = static_cast<float>(ray.v.x);
    row.rays.ray.dir_y[lane] = static_cast<float>(ray.v.y);
    row.rays.ray.dir_z[lane] = static_cast<float>(ray.v.z);
    row.rays.ray.tnear[lane] = 0.0f;
    row.rays.ray.tfar[lane] = std::numeric_limits<float>::infinity();
    row.rays.ray.time[lane] = 0.0f;
    row.rays.ray.mask[lane] = 0xffffffffu;
    row.rays.ray.id[lane] = static_cast<unsigned>(i);
    row.rays.ray.flags[lane] = 0;
    row.rays.hit.primID[lane] = 0;
    row.rays.hit.u[lane] = row.rays.hit.v[lane] = 0.0f;
    row.rays.hit.geomID[lane] = row.rays.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
  }
}

}  // namespace

Image<std::int32_t> objectsSeen(const Scene& scene, const CameraInfo& camera,
                                const Transform<World, Camera>& world_from_camera) {
  Transform<World, Camera> scene_from_camera = world_from_camera;
  scene_from_camera.translation_m = scene_from_camera.translation_m - scene.impl().origin_in_world;
  Image<std::int32_t> objects(camera.width, camera.height, -1);
  RowRays row;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; x += embree::kLanes) {
      setRays(camera, scene_from_camera, x, y, row);
      castRays(scene.impl(), row.valid, row.rays, true);
      for (int i = 0; i < std::min(embree::kLanes, camera.width - x); ++i) {
        const unsigned met = row.rays.hit.geomID[i];
        if (met != RTC_INVALID_GEOMETRY_ID) objects(x + i, y) = scene.impl().numbers[met];
      }
    }
  }
  return objects;
}

std::optional<std::string> seesNothing(const Scene& scene, const CameraInfo& camera,
                                       const Transform<World, Camera>& world_from_camera) {
  const auto objects = objectsSeen(scene, camera, world_from_camera);
  if (std::ranges::any_of(objects.pixels(), [](std::int32_t number) { return number >= 0; })) return std::nullopt;
  const Vec3d &from = world_from_camera.translation_m, &middle = scene.impl().origin_in_world;
  return fmt::format("no ray from this pose, at ({:.4g}, {:.4g}, {:.4g}) m, meets anything; the scene's middle is at ({:.4g}, {:.4g}, "
                     "{:.4g}) m, and it is {:.4g} m across",
                     from.x, from.y, from.z, middle.x, middle.y, middle.z, scene.impl().diagonal_m);
}

}  // namespace toftwin::sim
