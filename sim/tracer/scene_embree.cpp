// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/scene_embree.h"

#include <algorithm>

#include "sim/tracer/glass.h"
#include "sim/tracer/quadric_embree.h"

namespace toftwin::sim {
namespace {

RTCGeometry makeTriangleGeometry(RTCDevice device, const BuiltObject& object) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  // Embree owns its copy: a shared buffer would need 16 bytes of padding behind the last vertex.
  auto* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           3 * sizeof(float), object.vertices.size());
  std::ranges::transform(object.vertices, static_cast<std::array<float, 3>*>(vertices), [](const Vec3d& v) {
    return std::array{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
  });
  auto* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            3 * sizeof(std::uint32_t), object.triangles.size());
  std::ranges::copy(object.triangles, static_cast<std::array<std::uint32_t, 3>*>(triangles));
  if (object.glass != nullptr) letShadowRaysThrough(geometry, *object.glass);
  return geometry;
}

RTCScene newScene(RTCDevice device) {
  RTCScene scene = rtcNewScene(device);
  // Robust: rays through a shared edge or a rectangle's diagonal meet one of the two triangles.
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
  return scene;
}

void attachInstance(RTCDevice device, RTCScene scene, RTCScene shown, const std::array<float, 12>& columns) {
  RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(instance, shown);
  rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns.data());
  rtcCommitGeometry(instance);
  rtcAttachGeometry(scene, instance);
  rtcReleaseGeometry(instance);
}

std::array<float, 12> columnsOf(const Transform<World, Object>& pose) {
  std::array<float, 12> columns{};
  const Vec3d all[4] = {pose.rotate({1, 0, 0}), pose.rotate({0, 1, 0}), pose.rotate({0, 0, 1}),
                        pose.translation_m};
  for (std::size_t i = 0; i < 4; ++i) {
    columns[3 * i] = static_cast<float>(all[i].x);
    columns[3 * i + 1] = static_cast<float>(all[i].y);
    columns[3 * i + 2] = static_cast<float>(all[i].z);
  }
  return columns;
}

}  // namespace

RTCScene makeEmbreeScene(RTCDevice device, const std::vector<NumberedObject>& objects) {
  RTCScene scene = newScene(device);
  for (const auto& [id, object] : objects) {
    RTCGeometry geometry = object->triangles.empty() ? makeQuadricGeometry(device, *object)
                                                     : makeTriangleGeometry(device, *object);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, id);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(scene);
  return scene;
}

/// Only the boxes of the instances are sorted anew: microseconds, whatever they show.
RTCScene makeInstances(const Scene::Impl& loaded, const std::vector<Transform<World, Object>>& poses) {
  RTCScene scene = newScene(loaded.device);
  // The identity takes no rounding: what stands still is met exactly as without instances.
  if (loaded.movers.size() < loaded.objects.size()) {
    attachInstance(loaded.device, scene, loaded.still, columnsOf(Transform<World, Object>{}));
  }
  for (std::size_t i = 0; i < loaded.movers.size(); ++i) {
    attachInstance(loaded.device, scene, loaded.movers[i].embree, columnsOf(poses[i]));
  }
  rtcCommitScene(scene);
  return scene;
}

}  // namespace toftwin::sim
