// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/scene_embree.h"

#include <algorithm>
#include <new>

#include "sim/tracer/glass.h"
#include "sim/tracer/pairs.h"
#include "sim/tracer/quadric_embree.h"

namespace toftwin::sim {
namespace {

/// Memory for a geometry's numbers; Embree gives none where there is none left.
void* newBuffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, std::size_t stride, std::size_t count) {
  void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, stride, count);
  if (buffer == nullptr) throw std::bad_alloc{};
  return buffer;
}

template <std::size_t kCorners>
void setCorners(RTCGeometry geometry, RTCFormat format, const std::vector<std::array<std::uint32_t, kCorners>>& of) {
  void* corners = newBuffer(geometry, RTC_BUFFER_TYPE_INDEX, format, kCorners * sizeof(std::uint32_t), of.size());
  std::ranges::copy(of, static_cast<std::array<std::uint32_t, kCorners>*>(corners));
}

RTCGeometry makeMeshGeometry(RTCDevice device, const BuiltObject& object) {
  RTCGeometry geometry =
      rtcNewGeometry(device, object.is_paired ? RTC_GEOMETRY_TYPE_QUAD : RTC_GEOMETRY_TYPE_TRIANGLE);
  // Embree owns its copy: a shared buffer would need 16 bytes of padding behind the last vertex.
  auto* vertices = newBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, 3 * sizeof(float), object.vertices.size());
  std::ranges::transform(object.vertices, static_cast<std::array<float, 3>*>(vertices), [](const Vec3d& v) {
    return std::array{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
  });
  if (object.is_paired) {
    setCorners(geometry, RTC_FORMAT_UINT4, quadranglesOf(object.triangles));
  } else {
    setCorners(geometry, RTC_FORMAT_UINT3, object.triangles);
  }
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

}  // namespace

RTCScene makeEmbreeScene(RTCDevice device, const std::vector<NumberedObject>& objects, const std::stop_token& stop) {
  RTCScene scene = newScene(device);
  rtcSetSceneProgressMonitorFunction(
      scene, [](void* token, double) { return !static_cast<const std::stop_token*>(token)->stop_requested(); },
      const_cast<std::stop_token*>(&stop));
  for (const auto& [id, object] : objects) {
    RTCGeometry geometry = object->triangles.empty() ? makeQuadricGeometry(device, *object)
                                                     : makeMeshGeometry(device, *object);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, id);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(scene);
  rtcSetSceneProgressMonitorFunction(scene, nullptr, nullptr);
  return scene;
}

}  // namespace toftwin::sim
