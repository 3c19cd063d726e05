// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <toftwin/geometry.h>

#include "sim/tracer/bsdf/any.h"
#include "sim/tracer/coherent_tree.h"
#include "sim/tracer/embree.h"
#include "sim/tracer/environment.h"
#include "sim/tracer/few_triangles.h"
#include "sim/tracer/material.h"
#include "sim/tracer/motion.h"
#include "sim/tracer/quadric.h"
#include "sim/tracer/scene.h"
#include "sim/tracer/texture.h"

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
  /// In the scene's frame, or in its own if it moves; empty for quadrics. Embree gets them rounded to
  /// single precision.
  std::vector<Vec3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<TrianglePlane> planes;  ///< of the triangles
  bool is_paired = false;             ///< Embree has each two of them as a quadrangle (pairs.h)
  std::vector<std::array<TexturePlace, 3>>
      places;  ///< of the triangles' corners, if the material has a texture
  Quadric quadric;
  const bsdf::ThinGlass* glass = nullptr;  ///< if it is one: shadow rays go through
};

/// What a moving object is in the way of, of the lines through the ball around it.
struct Hiding {
  double all = 0.0;   ///< share that meet it
  double core = 0.0;  ///< radius of a ball around the same middle through which no line was found that does not, m
  double rim = 0.0;   ///< share of those beside the core that meet it
};

/// Where a moving object stands. Its geometry stays in its own frame: rays are taken there, and what they
/// meet is taken back.
struct Standing {
  RTCScene embree = nullptr;
  const CoherentTree* tree = nullptr;  ///< of meshes that have one
  std::uint32_t object = 0;            ///< its number
  Transform<World, Object> scene_from_object;
  std::array<Vec3d, 3> axes;  ///< of the object, in the scene
  Vec3f lower, upper;         ///< the box around it, in its own frame
  double radius = 0.0;        ///< of the ball around it whose middle is the box's, m
  Hiding hides{};
  double blur = 0.0;          ///< bound on what rounding moves rays by that are taken there, m
  bool is_paired = false;     ///< as its object

  /// Of the ball around it, in the scene.
  [[nodiscard]] Vec3d middle() const {
    const Vec3f own = (lower + upper) / 2.0f;
    const Vec3d exact{static_cast<double>(own.x), static_cast<double>(own.y), static_cast<double>(own.z)};
    return (scene_from_object * Point<Object>{exact}).m;
  }
};

/// What the tracer reads of an object at each hit.
struct ObjectRow {
  const TrianglePlane* planes;  ///< of a quadric: one that makes every hit one to compute by hand
  Material material;
  const Standing* standing = nullptr;  ///< of a moving object
};

/// A moving object, scaled, and an Embree scene of it alone.
struct Mover {
  std::size_t object = 0;
  Motion motion;
  Transform<World, Object> start;
  double reach = 0.0;  ///< largest |coordinate| in its own frame
  double radius = 0.0;  ///< of the ball around it whose middle is that of its box
  Hiding hides{};
  RTCScene embree = nullptr;
  std::shared_ptr<const CoherentTree> tree = nullptr;  ///< of meshes that are worth one
};

/// A scene as it was loaded, or as it stands at another time. The latter owns no more than the places of
/// its moving objects, and keeps what was loaded alive.
struct Scene::Impl {
  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl();

  std::string id;
  std::vector<std::string> notes;
  std::vector<std::int32_t> numbers;  ///< of `objects` in the scene file
  std::vector<Material> materials;
  std::vector<bsdf::Any> models;  ///< of the materials; `Material::special` points here
  std::vector<std::shared_ptr<const Texture>> textures;  // shared by a scene's poses
  std::shared_ptr<const Environment> environment;        // likewise; null if it is dark
  std::deque<BuiltObject> owned;                         ///< Embree points into them
  std::vector<std::reference_wrapper<const BuiltObject>> objects;
  std::vector<ObjectRow> rows;  ///< of `objects`, which they point into; the last one is that of nothing
  std::vector<Mover> movers;    ///< of the loaded scene
  std::vector<Standing> poses;  ///< of the movers
  std::vector<ForeignEmitterSpec> foreign_emitters;
  float ambient_radiance = 0.0f;
  bool is_matt = true;  ///< neither special models, textures nor surroundings but even ones: the fast path
  bool has_glass = false;

  /// The scene's frame is the world's, moved here: the middle of everything. Single-precision
  /// coordinates are then as fine as the scene is small, wherever in the world it stands.
  Vec3d origin_in_world;
  double diagonal_m = 1.0;  ///< of the box around everything

  RTCDevice device = nullptr;
  RTCScene still = nullptr;  ///< what does not move
  std::vector<FewTriangle> still_few;  ///< all of that, if it is so little; else empty
  std::vector<std::uint32_t> still_pairs;  ///< by object, and of nothing: 1 if its triangles are in pairs; empty if none are

  /// 0 of an object that stands still, else 1 + its number among `poses`.
  [[nodiscard]] int moverOf(unsigned object) const {
    const Standing* standing = rows[object].standing;
    return standing != nullptr ? static_cast<int>(standing - poses.data()) + 1 : 0;
  }

  std::shared_ptr<const Impl> loaded;  ///< of a scene at another time: what it was made from
};

/// Puts the movers into their places at a time, and makes rows for all objects.
void placeMovers(Scene::Impl& scene, const Scene::Impl& loaded, Duration time);

}  // namespace toftwin::sim
