// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <toftwin/geometry.h>

#include "sim/tracer/embree.h"
#include "sim/tracer/material.h"
#include "sim/tracer/quadric.h"
#include "sim/tracer/scene.h"

namespace toftwin::sim {

/// A triangle as the tracer uses it; planeOf() makes it.
struct TrianglePlane {
  Vec3d normal;        ///< unit
  double level;        ///< normal · p on the plane
  float offset;        ///< bound on the error of finding a ray's side of the plane, m
  float margin;        ///< how far starts of rays keep from its edges, m
  float margin_share;  ///< the margin as a share of the triangle's smallest height
};

/// One object as Embree sees it; its index is Embree's geometry id.
struct BuiltObject {
  std::size_t material = 0;
  /// In the scene's frame; empty for quadrics. Embree gets them rounded to single precision.
  std::vector<Vec3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<TrianglePlane> planes;  ///< of the triangles
  Quadric quadric;
};

/// What the tracer reads of an object at each hit.
struct ObjectRow {
  const TrianglePlane* planes;  ///< of a quadric: one that makes every hit one to compute by hand
  Material material;
};

struct Scene::Impl {
  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl();

  std::string id;
  std::vector<Material> materials;
  std::vector<BuiltObject> objects;  ///< Embree points into them
  std::vector<ObjectRow> rows;       ///< of `objects`, which they point into; the last one is that of nothing
  float ambient_radiance = 0.0f;

  /// The scene's frame is the world's, moved here: the middle of everything. Single-precision
  /// coordinates are then as fine as the scene is small, wherever in the world it stands.
  Vec3d origin_in_world;

  RTCDevice device = nullptr;
  RTCScene embree = nullptr;
};

}  // namespace toftwin::sim
