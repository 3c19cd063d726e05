// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/quadric_embree.h"

#include <cmath>

#include "sim/tracer/glass.h"

namespace toftwin::sim {
namespace {

const BuiltObject& objectOf(void* pointer) { return *static_cast<const BuiltObject*>(pointer); }
const Quadric& quadricOf(void* pointer) { return objectOf(pointer).quadric; }

float below(double v) { return std::nextafter(static_cast<float>(v), -INFINITY); }
float above(double v) { return std::nextafter(static_cast<float>(v), INFINITY); }

void bounds(const RTCBoundsFunctionArguments* arguments) {
  const Quadric& quadric = quadricOf(arguments->geometryUserPtr);
  // Half extent along each of the scene's axes: that of a disc of radius r with normal z is
  // r √(1 − z_i²), that of a cylinder adds h |z_i|, that of a sphere is r.
  const auto extent = [&](double z) {
    if (quadric.kind == Quadric::Kind::Sphere) return quadric.radius;
    return quadric.radius * std::sqrt(std::max(0.0, 1.0 - z * z)) + quadric.half_height * std::abs(z);
  };
  const Vec3d c = quadric.centre, z = quadric.axes[2];
  const Vec3d half{extent(z.x), extent(z.y), extent(z.z)};
  RTCBounds& box = *arguments->bounds_o;
  box.lower_x = below(c.x - half.x);
  box.lower_y = below(c.y - half.y);
  box.lower_z = below(c.z - half.z);
  box.upper_x = above(c.x + half.x);
  box.upper_y = above(c.y + half.y);
  box.upper_z = above(c.z + half.z);
}

struct Nearest {
  double t;
  int part;
  bool is_hit;
};

/// The nearest crossing with near < t < far.
Nearest nearest(const Quadric& quadric, Vec3d o, Vec3d d, double near, double far) {
  Nearest best{far, 0, false};
  const Vec3d local_o = quadric.toLocal(o - quadric.centre), local_d = quadric.toLocal(d);
  const int parts = quadric.kind == Quadric::Kind::Cylinder ? 3 : 1;
  for (int part = 0; part < parts; ++part) {
    const Crossings at = crossings(quadric, part, local_o, local_d);
    for (const double t : {at.first, at.second}) {
      if (t > near && t < best.t) best = {t, part, true};  // false for NaN
    }
  }
  return best;
}

Vec3d originOf(RTCRayN* ray, unsigned n, unsigned i) {
  return {static_cast<double>(RTCRayN_org_x(ray, n, i)), static_cast<double>(RTCRayN_org_y(ray, n, i)),
          static_cast<double>(RTCRayN_org_z(ray, n, i))};
}
Vec3d directionOf(RTCRayN* ray, unsigned n, unsigned i) {
  return {static_cast<double>(RTCRayN_dir_x(ray, n, i)), static_cast<double>(RTCRayN_dir_y(ray, n, i)),
          static_cast<double>(RTCRayN_dir_z(ray, n, i))};
}
Nearest nearestOf(const Quadric& quadric, RTCRayN* ray, unsigned n, unsigned i) {
  return nearest(quadric, originOf(ray, n, i), directionOf(ray, n, i),
                 static_cast<double>(RTCRayN_tnear(ray, n, i)), static_cast<double>(RTCRayN_tfar(ray, n, i)));
}

void intersect(const RTCIntersectFunctionNArguments* arguments) {
  const Quadric& quadric = quadricOf(arguments->geometryUserPtr);
  const unsigned n = arguments->N;
  RTCRayN* rays = RTCRayHitN_RayN(arguments->rayhit, n);
  RTCHitN* hits = RTCRayHitN_HitN(arguments->rayhit, n);
  for (unsigned i = 0; i < n; ++i) {
    if (arguments->valid[i] != -1) continue;
    const Nearest hit = nearestOf(quadric, rays, n, i);
    if (!hit.is_hit) continue;
    RTCRayN_tfar(rays, n, i) = static_cast<float>(hit.t);
    RTCHitN_u(hits, n, i) = static_cast<float>(hit.part);
    RTCHitN_v(hits, n, i) = 0.0f;
    RTCHitN_geomID(hits, n, i) = arguments->geomID;
    RTCHitN_primID(hits, n, i) = arguments->primID;
    RTCHitN_instID(hits, n, i, 0) = arguments->context->instID[0];
  }
}

/// A shadow ray goes through every wall of thin glass and pays for each.
void crossEachWall(const Quadric& quadric, const bsdf::ThinGlass& glass, const RTCOccludedFunctionNArguments* arguments,
                   unsigned i) {
  const unsigned n = arguments->N;
  const Vec3d o = quadric.toLocal(originOf(arguments->ray, n, i) - quadric.centre);
  const Vec3d d = quadric.toLocal(directionOf(arguments->ray, n, i));
  const auto near = static_cast<double>(RTCRayN_tnear(arguments->ray, n, i));
  const auto far = static_cast<double>(RTCRayN_tfar(arguments->ray, n, i));
  const int parts = quadric.kind == Quadric::Kind::Cylinder ? 3 : 1;
  for (int part = 0; part < parts; ++part) {
    const Crossings at = crossings(quadric, part, o, d);
    for (const double t : {at.first, at.second}) {
      if (!(t > near && t < far)) continue;
      const Vec3d normal = ontoSurface(quadric, part, o + d * t).normal;
      crossGlass(arguments->context, RTCRayN_id(arguments->ray, n, i), glass, dot(normal, d) / norm(d));
    }
  }
}

void occluded(const RTCOccludedFunctionNArguments* arguments) {
  const BuiltObject& object = objectOf(arguments->geometryUserPtr);
  const Quadric& quadric = object.quadric;
  const unsigned n = arguments->N;
  for (unsigned i = 0; i < n; ++i) {
    if (arguments->valid[i] != -1) continue;
    if (object.glass != nullptr) {
      crossEachWall(quadric, *object.glass, arguments, i);
      continue;
    }
    if (nearestOf(quadric, arguments->ray, n, i).is_hit) RTCRayN_tfar(arguments->ray, n, i) = -INFINITY;
  }
}

}  // namespace

RTCGeometry makeQuadricGeometry(RTCDevice device, const BuiltObject& object) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, 1);
  // Embree hands the pointer back as it got it; the callbacks only read through it.
  rtcSetGeometryUserData(geometry, const_cast<BuiltObject*>(&object));
  rtcSetGeometryBoundsFunction(geometry, bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, intersect);
  rtcSetGeometryOccludedFunction(geometry, occluded);
  return geometry;
}

}  // namespace toftwin::sim
