// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/few_triangles.h"

#include <algorithm>
#include <limits>

#include "sim/tracer/lanes.h"
#include "sim/tracer/scene_impl.h"
#include "tests/tracer/packets.h"
#include "tests/tracer/tracing.h"

namespace toftwin::sim::testing {
namespace {

const std::string kEmptyRoom = R"(
[[material]]
name = "m"
albedo = 0.5
[[object]]
shape = "box"
size_m = [4, 2.5, 5]
position_m = [0, 0, 2]
euler_deg = [3, 17, 5]
material = "m"
)";
/// With a box and a rectangle: 26 triangles.
const std::string kRoom = kEmptyRoom + R"([[object]]
shape = "box"
size_m = [0.5, 0.7, 0.4]
position_m = [0.3, -0.2, 1.8]
euler_deg = [31, 7, 11]
material = "m"
[[object]]
shape = "rectangle"
size_m = [0.8, 0.6, 0]
position_m = [-0.6, 0.4, 2.4]
euler_deg = [20, 40, 0]
material = "m"
)";

TEST(FewTriangles, AreThoseOfScenesThatHaveNoMore) {
  EXPECT_EQ(sceneOf(kRoom).impl().still_few.size(), 26u);
  const std::string box = "[[object]]\nshape = 'box'\nsize_m = [1, 1, 1]\nposition_m = [0, 0, 4]\nmaterial = 'm'\n";
  EXPECT_TRUE(sceneOf(kRoom + box).impl().still_few.empty()) << "38";
  EXPECT_EQ(sceneOf(kRoom + box + "velocity_m_per_s = [1, 0, 0]\n").at(1_s).impl().still_few.size(), 26u)
      << "what moves is not among them";
  std::string more = kRoom;
  for (const char* z : {"4", "5", "6"}) {
    more += "[[object]]\nshape = 'rectangle'\nsize_m = [1, 1, 0]\nmaterial = 'm'\nposition_m = [0, 0, " + std::string{z} + "]\n";
  }
  EXPECT_EQ(sceneOf(more).impl().still_few.size(), kFewTriangles);
  const std::string sphere = "[[object]]\nshape = 'sphere'\nradius_m = 0.2\nposition_m = [0, 0, 3]\nmaterial = 'm'\n";
  EXPECT_TRUE(sceneOf(kRoom + sphere).impl().still_few.empty());
}

/// Rays that start and end anywhere in the room, some of which do not count: what Embree says, but within 1e-5 of an
/// edge or of a ray's ends.
TEST(FewTriangles, AreMetWhereEmbreeMeetsThem) {
  const Scene scene = sceneOf(kRoom);
  const Scene::Impl& impl = scene.impl();
  constexpr unsigned kSeed = 20261128;
  Draw draw{kSeed};
  int met = 0, blocked = 0;
  for (int packet = 0; packet < 4000; ++packet) {
    Places from, to;
    for (std::size_t i = 0; i < kLaneCount; ++i) from[i] = pointIn(draw, 1.2), to[i] = pointIn(draw, 2.5);
    const RTCRayHit16 rays = raysBetween(from, to, packet % 2 == 0 ? 1.0 : 10.0);
    Lanes<int> valid;
    for (std::size_t i = 0; i < kLaneCount; ++i) valid[i] = draw() % 8 == 0 ? 0 : -1;
    RTCRayHit16 ours = rays, embrees = rays;
    intersectFew(impl.still_few, valid.v, ours);
    embree::intersect(valid.v, impl.still, embrees, false);
    RTCRay16 our_shadows = rays.ray, embree_shadows = rays.ray;
    occludedFew(impl.still_few, valid.v, our_shadows);
    embree::occluded(valid.v, impl.still, embree_shadows, false);
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      if (valid[i] == 0) {
        ASSERT_EQ(ours.ray.tfar[i], rays.ray.tfar[i]);
        ASSERT_EQ(our_shadows.tfar[i], rays.ray.tfar[i]);
        ASSERT_EQ(ours.hit.geomID[i], RTC_INVALID_GEOMETRY_ID);
        continue;
      }
      const float u = embrees.hit.u[i], v = embrees.hit.v[i];
      const bool is_at_edge = std::min({u, v, 1.0f - u - v}) < 1e-5f;
      const bool is_at_end = embrees.ray.tfar[i] < 1e-5f || embrees.ray.tfar[i] > (1.0f - 1e-5f) * rays.ray.tfar[i];
      const bool is_met = embrees.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
      met += is_met ? 1 : 0;
      ASSERT_NEAR(ours.ray.tfar[i], embrees.ray.tfar[i], 1e-5f * embrees.ray.tfar[i] + 1e-6f) << packet << ", " << i;
      if ((is_met && is_at_edge) || (is_at_end && is_met)) continue;
      ASSERT_EQ(ours.hit.geomID[i], embrees.hit.geomID[i]) << packet << ", " << i;
      if (is_met) {
        ASSERT_EQ(ours.hit.primID[i], embrees.hit.primID[i]);
        ASSERT_NEAR(ours.hit.u[i], u, 1e-4);
        ASSERT_NEAR(ours.hit.v[i], v, 1e-4);
      }
      ASSERT_EQ(our_shadows.tfar[i] < 0.0f, is_met);
      ASSERT_EQ(embree_shadows.tfar[i] < 0.0f, is_met);
      blocked += our_shadows.tfar[i] < 0.0f ? 1 : 0;
    }
  }
  EXPECT_GT(met, 30'000);
  EXPECT_GT(blocked, 30'000);
}

/// From within a box, at points on its edges and on its faces' diagonals: no ray gets out between two triangles.
TEST(FewTriangles, LetNothingThroughTheirEdges) {
  const Scene scene = sceneOf(kEmptyRoom);
  const Scene::Impl& impl = scene.impl();
  ASSERT_EQ(impl.still_few.size(), 12u);
  constexpr unsigned kSeed = 7;
  Draw draw{kSeed};
  std::uniform_real_distribution<float> share{0.0f, 1.0f};
  Lanes<int> valid = everyLane();
  for (int packet = 0; packet < 20'000; ++packet) {
    Places from, to;
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const FewTriangle& t = impl.still_few[draw() % 12];
      const Vec3f ends[] = {t.a, t.b, t.c};
      const std::size_t first = draw() % 3;
      const Vec3f p = ends[first], q = ends[(first + 1) % 3];
      const float s = share(draw);
      const Vec3f at = p + (q - p) * s;
      from[i] = pointIn(draw, 1.0);
      to[i] = {static_cast<double>(at.x), static_cast<double>(at.y), static_cast<double>(at.z)};
    }
    RTCRayHit16 rays = raysBetween(from, to, 100.0);
    RTCRay16 shadows = rays.ray;
    intersectFew(impl.still_few, valid.v, rays);
    occludedFew(impl.still_few, valid.v, shadows);
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      ASSERT_NE(rays.hit.geomID[i], RTC_INVALID_GEOMETRY_ID) << packet << ", " << i;
      ASSERT_LT(shadows.tfar[i], 0.0f);
    }
  }
}

/// The same exactly along edges, diagonals and through corners, where nothing is rounded: from the middle of a cube at
/// the places of a grid on its faces.
TEST(FewTriangles, LetNothingThroughExactlyOnTheirEdges) {
  const Scene scene = sceneOf(
      "[[material]]\nname = 'm'\nalbedo = 0.5\n[[object]]\nshape = 'box'\nsize_m = [2, 2, 2]\nmaterial = 'm'\n");
  const Scene::Impl& impl = scene.impl();
  ASSERT_EQ(impl.still_few.size(), 12u);
  Lanes<int> valid = everyLane();
  for (int place = 0; place < 6 * 17; ++place) {
    const int face = place / 17, row = place % 17 - 8;
    for (int half = 0; half < 2; ++half) {
      Places from{}, to;
      for (std::size_t i = 0; i < kLaneCount; ++i) {
        const double a = (static_cast<int>(i) + half) / 8.0 - 1.0, b = row / 8.0, c = face % 2 == 0 ? -1.0 : 1.0;
        to[i] = face / 2 == 0 ? Vec3d{a, b, c} : face / 2 == 1 ? Vec3d{b, c, a} : Vec3d{c, a, b};
      }
      RTCRayHit16 rays = raysBetween(from, to, 2.0);
      for (std::size_t i = 0; i < kLaneCount; ++i) {
        rays.ray.dir_x[i] = static_cast<float>(to[i].x);  // not of length 1, and so not rounded
        rays.ray.dir_y[i] = static_cast<float>(to[i].y);
        rays.ray.dir_z[i] = static_cast<float>(to[i].z);
      }
      intersectFew(impl.still_few, valid.v, rays);
      for (const float distance : rays.ray.tfar) ASSERT_EQ(distance, 1.0f) << face << ", " << row;
    }
  }
}

}  // namespace
}  // namespace toftwin::sim::testing
