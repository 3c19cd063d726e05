// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/coherent_tree.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>

#include "sim/tracer/hit.h"
#include "sim/tracer/packet.h"
#include "sim/tracer/scene_impl.h"
#include "tests/tracer/packets.h"
#include "tests/tracer/tracing.h"

namespace toftwin::sim::testing {
namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;
constexpr double kRadius = 0.5;

struct Mesh {
  std::vector<Vec3d> vertices;
  Triangles triangles;  ///< in pairs

  [[nodiscard]] Vec3d corner(std::size_t triangle, std::size_t which) const {
    return vertices[triangles[triangle][which]];
  }
};

/// A ball of 2 steps² triangles, with bumps of so much of its radius; corners are single-precision numbers.
Mesh ball(int steps, double bumps) {
  Mesh mesh;
  for (int i = 0; i <= steps; ++i) {
    for (int j = 0; j <= steps; ++j) {
      const double theta = kPi * i / steps, phi = 2.0 * kPi * (j % steps) / steps;
      const double r = kRadius * (1.0 + bumps * std::sin(5.0 * theta) * std::sin(4.0 * phi));
      const auto single = [](double v) { return static_cast<double>(static_cast<float>(v)); };
      const bool is_pole = i == 0 || i == steps;
      mesh.vertices.push_back({is_pole ? 0.0 : single(r * std::sin(theta) * std::cos(phi)),
                               is_pole ? 0.0 : single(r * std::sin(theta) * std::sin(phi)),
                               single(r * std::cos(theta))});
    }
  }
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < steps; ++j) {
      const auto a = static_cast<std::uint32_t>(i * (steps + 1) + j), b = a + static_cast<std::uint32_t>(steps) + 1;
      mesh.triangles.push_back({a, b, b + 1});
      mesh.triangles.push_back({a, b + 1, a + 1});
    }
  }
  return mesh;
}

Vec3d rounded(Vec3d v) {
  return {static_cast<double>(static_cast<float>(v.x)), static_cast<double>(static_cast<float>(v.y)),
          static_cast<double>(static_cast<float>(v.z))};
}

/// A ray in double precision against every triangle.
struct Crossing {
  std::size_t triangle;
  double distance, u, v;
  [[nodiscard]] double least() const { return std::min({u, v, 1.0 - u - v}); }
};
std::optional<Crossing> cross(const Mesh& mesh, std::size_t t, Vec3d o, Vec3d d) {
  const Vec3d a = mesh.corner(t, 0), e = mesh.corner(t, 1) - a, f = mesh.corner(t, 2) - a, p = toftwin::cross(d, f);
  const double det = dot(e, p);
  if (std::abs(det) < 1e-300) return std::nullopt;
  const Vec3d s = o - a, q = toftwin::cross(s, e);
  const Crossing at{t, dot(f, q) / det, dot(s, p) / det, dot(d, q) / det};
  return at.least() < -1e-5 ? std::nullopt : std::optional{at};
}
std::vector<Crossing> crossings(const Mesh& mesh, Vec3d o, Vec3d d) {
  std::vector<Crossing> all;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (const auto at = cross(mesh, t, o, d); at && at->distance > 0.0) all.push_back(*at);
  }
  std::ranges::sort(all, {}, &Crossing::distance);
  return all;
}

Vec3d originOf(const RTCRay16& rays, std::size_t i) {
  return {static_cast<double>(rays.org_x[i]), static_cast<double>(rays.org_y[i]), static_cast<double>(rays.org_z[i])};
}
Vec3d directionOf(const RTCRay16& rays, std::size_t i) {
  return {static_cast<double>(rays.dir_x[i]), static_cast<double>(rays.dir_y[i]), static_cast<double>(rays.dir_z[i])};
}

Lanes<int> mostLanes(Draw& draw) {
  Lanes<int> valid;
  for (std::size_t i = 0; i < kLaneCount; ++i) valid[i] = draw() % 8 == 0 ? 0 : -1;
  valid[draw() % kLaneCount] = -1;
  return valid;
}

/// Bundles from anywhere, inside and outside, that go anywhere: what a ray meets in double precision. Within 1e-5 of an
/// edge, of its triangle's size, either side of it is right.
TEST(CoherentTree, MeetsWhatIsNearest) {
  const Mesh mesh = ball(20, 0.1);
  constexpr unsigned kSeed = 20261128;
  for (const bool is_paired : {true, false}) {
    const CoherentTree tree{mesh.vertices, mesh.triangles, is_paired};
    Draw draw{kSeed};
    int done = 0, met = 0, missed = 0;
    for (int bundle = 0; bundle < 600; ++bundle) {
      const Vec3d apex = rounded(pointIn(draw, bundle % 4 == 0 ? 0.2 : 1.5)), middle = pointIn(draw, 0.5);
      Places from, to;
      for (std::size_t i = 0; i < kLaneCount; ++i) from[i] = apex, to[i] = middle + pointIn(draw, 0.05);
      // As far as the ball's middle and no farther, every third time.
      RTCRayHit16 rays = raysBetween(from, to, bundle % 3 == 0 ? 1.0 : 10.0);
      const RTCRayHit16 before = rays;
      const Lanes<int> valid = mostLanes(draw);
      if (!tree.intersect(valid.v, 7, rays)) {
        ASSERT_EQ(std::memcmp(&rays, &before, sizeof rays), 0);
        continue;
      }
      ++done;
      for (std::size_t i = 0; i < kLaneCount; ++i) {
        const auto all = crossings(mesh, originOf(before.ray, i), directionOf(before.ray, i));
        const bool may_be = valid[i] != 0 && !all.empty() && all[0].distance <= static_cast<double>(before.ray.tfar[i]);
        const bool is_clear =
            all.empty() ||
            (all[0].least() > 1e-5 && std::abs(all[0].distance / static_cast<double>(before.ray.tfar[i]) - 1.0) > 1e-5);
        const bool is_met = rays.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
        if (valid[i] != 0 && !is_clear) continue;
        ASSERT_EQ(is_met, may_be) << bundle << ", " << i;
        if (!is_met) {
          ++missed;
          ASSERT_EQ(rays.ray.tfar[i], before.ray.tfar[i]);
          continue;
        }
        ++met;
        ASSERT_EQ(rays.hit.geomID[i], 7u);
        ASSERT_EQ(rays.hit.primID[i], all[0].triangle) << bundle << ", " << i;
        ASSERT_NEAR(static_cast<double>(rays.ray.tfar[i]), all[0].distance, 1e-5);
        ASSERT_NEAR(static_cast<double>(rays.hit.u[i]), all[0].u, 2e-5);
        ASSERT_NEAR(static_cast<double>(rays.hit.v[i]), all[0].v, 2e-5);
      }
    }
    EXPECT_GT(done, 500);
    EXPECT_GT(met, 4000);
    EXPECT_GT(missed, 1000);
  }
}

/// From inside a closed mesh, along its edges, nothing gets out. (Through a corner itself, as with Embree, one ray in
/// many may.)
TEST(CoherentTree, LetsNothingThroughItsEdges) {
  const Mesh mesh = ball(20, 0.1);
  const CoherentTree tree{mesh.vertices, mesh.triangles, true};
  constexpr unsigned kSeed = 5;
  Draw draw{kSeed};
  std::uniform_real_distribution<double> share{0.0, 1.0};
  Lanes<int> valid = everyLane();
  int done = 0;
  for (int bundle = 0; bundle < 20'000; ++bundle) {
    const Vec3d apex = rounded(pointIn(draw, 0.2));
    const std::size_t triangle = draw() % mesh.triangles.size();
    Places from, to;
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const std::size_t first = draw() % 3;
      const Vec3d p = mesh.corner(triangle, first), q = mesh.corner(triangle, (first + 1) % 3);
      from[i] = apex;
      to[i] = p + (q - p) * (0.001 + 0.998 * share(draw));
    }
    RTCRayHit16 rays = raysBetween(from, to, 100.0);
    if (!tree.intersect(valid.v, 0, rays)) continue;
    ++done;
    for (const unsigned object : rays.hit.geomID) ASSERT_EQ(object, 0u) << bundle;
  }
  EXPECT_GT(done, 18'000);
}

/// Shadow rays from anywhere to a point that shines: blocked if something lies between, in double precision.
TEST(CoherentTree, HidesWhatLiesBehindSomething) {
  const Mesh mesh = ball(20, 0.1);
  const CoherentTree tree{mesh.vertices, mesh.triangles, true};
  constexpr unsigned kSeed = 11;
  Draw draw{kSeed};
  int done = 0, hidden = 0, lit = 0;
  for (int bundle = 0; bundle < 1000; ++bundle) {
    const Vec3d shine = pointIn(draw, 2.0), around = pointIn(draw, bundle % 3 == 0 ? 0.3 : 1.5);
    Places from, to;
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      from[i] = rounded(around + pointIn(draw, 0.05));
      to[i] = shine;
    }
    const Lanes<int> valid = mostLanes(draw);
    const RTCRay16 before = raysBetween(from, to, 1.0).ray;
    RTCRay16 rays = before;
    if (!tree.occluded(valid.v, rays)) {
      ASSERT_EQ(std::memcmp(&rays, &before, sizeof rays), 0);
      continue;
    }
    ++done;
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      const double end = static_cast<double>(before.tfar[i]);
      bool is_hidden = false, is_clear = true;
      for (const Crossing& at : crossings(mesh, originOf(before, i), directionOf(before, i))) {
        if (at.distance > end * (1.0 + 1e-5)) break;
        is_clear = is_clear && at.least() > 1e-4 && at.distance > 1e-5 && at.distance < end * (1.0 - 1e-5);
        is_hidden = true;
      }
      if (valid[i] == 0) {
        ASSERT_EQ(rays.tfar[i], before.tfar[i]);
        continue;
      }
      if (!is_clear) continue;
      ASSERT_EQ(rays.tfar[i] < 0.0f, is_hidden) << bundle << ", " << i;
      (is_hidden ? hidden : lit) += 1;
    }
  }
  EXPECT_GT(done, 900);
  EXPECT_GT(hidden, 1000);
  EXPECT_GT(lit, 1000);
}

/// What is convex hides nothing of itself but what faces away, however near to its edges rays start. (Of what faces
/// away, rays from next to an edge may pass over it.)
TEST(CoherentTree, HidesNothingOfWhatIsConvex) {
  const Mesh mesh = ball(24, 0.0);
  const CoherentTree tree{mesh.vertices, mesh.triangles, true};
  constexpr unsigned kSeed = 3;
  Draw draw{kSeed};
  std::uniform_real_distribution<double> share{0.0, 1.0};
  Lanes<int> valid = everyLane();
  int lit = 0, hidden = 0;
  for (int bundle = 0; bundle < 20'000; ++bundle) {
    const Vec3d shine = pointIn(draw, 2.0);
    if (norm(shine) < 1.2 * kRadius) continue;
    const std::size_t triangle = draw() % mesh.triangles.size();
    const Vec3d a = mesh.corner(triangle, 0), b = mesh.corner(triangle, 1), c = mesh.corner(triangle, 2);
    const TrianglePlane plane = planeOf(a, b, c);
    if (!(norm(toftwin::cross(b - a, c - a)) > 1e-9)) continue;  // at a pole
    const Vec3d n = dot(plane.normal, a) > 0.0 ? plane.normal : -plane.normal;
    const double height = dot(n, shine - a);
    if (height < 0.0 ? height > -0.3 : height < 1e-3) continue;
    Places from, to;
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      // As near to edges as the tracer lets them.
      const double least = 2.0 * static_cast<double>(plane.margin_share), along = share(draw);
      const double u = i % 2 == 0 ? least : along * (1.0 - 3.0 * least),
                   v = least + share(draw) * (1.0 - u - 2.0 * least);
      const Vec3d start = a + (b - a) * u + (c - a) * v + n * static_cast<double>(plane.offset);
      from[i] = rounded(start + n * 1e-7);
      to[i] = shine;
    }
    RTCRay16 rays = raysBetween(from, to, 1.0 - 0x1p-22).ray;
    if (!tree.occluded(valid.v, rays)) continue;
    for (std::size_t i = height < 0.0 ? 1 : 0; i < kLaneCount; i += height < 0.0 ? 2 : 1)
      ASSERT_EQ(rays.tfar[i] < 0.0f, height < 0.0) << bundle << ", " << i << ": " << height;
    (height < 0.0 ? hidden : lit) += 1;
  }
  EXPECT_GT(lit, 3000);
  EXPECT_GT(hidden, 3000);
}

/// Rays that do not count may go anywhere, and start anywhere, or have no numbers at all.
TEST(CoherentTree, AsksOnlyAboutRaysThatCount) {
  const Mesh mesh = ball(20, 0.1);
  const CoherentTree tree{mesh.vertices, mesh.triangles, true};
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  constexpr unsigned kSeed = 13;
  Draw draw{kSeed};
  const Vec3d apex{0.1, 0.0, -2.0};
  Places from, to, back;
  for (std::size_t i = 0; i < kLaneCount; ++i)
    from[i] = apex, to[i] = pointIn(draw, 0.1), back[i] = to[i] + Vec3d{0.0, 0.0, 1.0};
  Lanes<int> valid = everyLane();
  RTCRayHit16 all = raysBetween(from, to, 10.0);
  RTCRay16 all_shadows = raysBetween(back, from, 1.0).ray;
  ASSERT_TRUE(tree.intersect(valid.v, 0, all) && tree.occluded(valid.v, all_shadows));
  for (int turn = 0; turn < 200; ++turn) {
    RTCRayHit16 rays = raysBetween(from, to, 10.0);
    RTCRay16 shadows = raysBetween(back, from, 1.0).ray;
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      valid[i] = draw() % 3 == 0 ? 0 : -1;
      if (valid[i] != 0) continue;
      const float odd[] = {0.0f, -1.0f, kNaN, 1e30f};
      rays.ray.dir_z[i] = odd[draw() % 4];
      rays.ray.org_x[i] = odd[draw() % 4];
      shadows.org_z[i] = draw() % 2 == 0 ? -2.0f : odd[draw() % 4];
      shadows.tfar[i] = odd[draw() % 4];
    }
    if (!isAny(valid)) continue;
    ASSERT_TRUE(tree.intersect(valid.v, 0, rays));
    ASSERT_TRUE(tree.occluded(valid.v, shadows));
    for (std::size_t i = 0; i < kLaneCount; ++i) {
      if (valid[i] == 0) continue;
      ASSERT_EQ(rays.hit.primID[i], all.hit.primID[i]) << turn << ", " << i;
      ASSERT_EQ(rays.ray.tfar[i], all.ray.tfar[i]);
      ASSERT_EQ(shadows.tfar[i], all_shadows.tfar[i]);
      ASSERT_LT(shadows.tfar[i], 0.0f);
    }
  }
}

TEST(CoherentTree, GivesUpWhatIsNoBundle) {
  const Mesh mesh = ball(160, 0.05);
  const CoherentTree tree{mesh.vertices, mesh.triangles, true};
  Lanes<int> valid = everyLane();
  constexpr unsigned kSeed = 2;
  Draw draw{kSeed};
  Places one, other, narrow, wide, around;
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    one[i] = {0.0, 0.0, -2.0};
    other[i] = {0.0, i == 3 ? 0.01 : 0.0, -2.0};
    narrow[i] = pointIn(draw, 0.01);
    wide[i] = pointIn(draw, 0.4);
    around[i] = i % 2 == 0 ? Vec3d{0.0, 0.0, -1.0} : Vec3d{0.0, 0.1, -3.0};
  }
  const auto isDone = [&](const Places& from, const Places& to) {
    RTCRayHit16 rays = raysBetween(from, to, 1.0);
    const RTCRayHit16 before = rays;
    const bool is_done = tree.intersect(valid.v, 0, rays);
    EXPECT_EQ(std::memcmp(&rays, &before, sizeof rays) != 0, is_done);
    return is_done;
  };
  EXPECT_TRUE(isDone(one, narrow));
  EXPECT_FALSE(isDone(other, narrow)) << "not from one place";
  EXPECT_FALSE(isDone(one, around)) << "not one way";
  EXPECT_FALSE(isDone(one, wide)) << "through too much";
  const auto isShadowDone = [&](const Places& from, const Places& to, double reach) {
    RTCRay16 rays = raysBetween(from, to, reach).ray;
    return tree.occluded(valid.v, rays);
  };
  EXPECT_TRUE(isShadowDone(narrow, one, 1.0));
  EXPECT_FALSE(isShadowDone(narrow, one, 0.5)) << "not to one place";
  valid[3] = 0;
  EXPECT_TRUE(isDone(other, narrow)) << "the one from elsewhere does not count";
}

/// One triangle has a tree as well.
TEST(CoherentTree, IsOfOneTriangle) {
  const CoherentTree tree{{{-1, -1, 1}, {1, -1, 1}, {0, 1, 1}}, {{0, 1, 2}}, false};
  Lanes<int> valid = everyLane();
  Places from{}, to;
  for (std::size_t i = 0; i < kLaneCount; ++i) to[i] = {0.001 * static_cast<double>(i), 0.0, 1.0};
  RTCRayHit16 rays = raysBetween(from, to, 10.0);
  ASSERT_TRUE(tree.intersect(valid.v, 1, rays));
  for (std::size_t i = 0; i < kLaneCount; ++i) {
    EXPECT_EQ(rays.hit.primID[i], 0u);
    EXPECT_NEAR(static_cast<double>(rays.ray.tfar[i]), norm(to[i]), 1e-6);
  }
}

/// Pixels and triangles of about one size: bundles are not given up (else the next test would compare Embree with
/// itself).
TEST(CoherentTree, TakesBlocksOfPixels) {
  const Mesh mesh = ball(96, 0.05);
  const CoherentTree tree{mesh.vertices, mesh.triangles, true};
  Lanes<int> valid = everyLane();
  int done = 0, all = 0;
  for (int y = -16; y < 16; ++y) {
    for (int x = -16; x < 16; ++x, ++all) {
      Places from, to;
      for (std::size_t i = 0; i < kLaneCount; ++i) {
        from[i] = {0.0, 0.0, -1.6};
        to[i] = {(4 * x + static_cast<int>(i % 4)) * 1.6 / 150.0, (4 * y + static_cast<int>(i / 4)) * 1.6 / 150.0, 0.0};
      }
      RTCRayHit16 rays = raysBetween(from, to, 2.0);
      done += tree.intersect(valid.v, 0, rays) ? 1 : 0;
    }
  }
  EXPECT_EQ(done, all);
}

/// A mesh that moves is seen through its tree, one that stands still through Embree: the same light, but for single
/// pixels on edges.
TEST(CoherentTree, ShowsWhatEmbreeShows) {
  const auto folder = std::filesystem::temp_directory_path() / fmt::format("toftwin_coherent_tree_test_{}", ::getpid());
  std::filesystem::create_directories(folder);
  {
    const Mesh mesh = ball(96, 0.05);
    std::ofstream out{folder / "ball.obj"};
    for (const Vec3d& v : mesh.vertices) out << fmt::format("v {} {} {}\n", v.x, v.y, v.z);
    for (const auto& [a, b, c] : mesh.triangles) out << fmt::format("f {} {} {}\n", a + 1, b + 1, c + 1);
  }
  const auto sceneWith = [&](const std::string& motion) {
    auto scene = Scene::parse(
        "[[material]]\nname = 'm'\nalbedo = 0.8\n[[object]]\nshape = 'box'\nsize_m = [4, 3, 6]\n"
        "material = 'm'\n[[object]]\nmesh = 'ball.obj'\nmaterial = 'm'\nposition_m = [0.1, 0.05, 1.6]\n"
        "euler_deg = [10, 20, 30]\n" +
            motion,
        folder / "scene.toml");
    if (!scene) throw std::runtime_error{scene.error().message};
    return *std::move(scene);
  };
  const Scene moving = sceneWith("velocity_m_per_s = [0.5, 0, 0]\n").at(0_ms), still = sceneWith("");
  std::filesystem::remove_all(folder);
  ASSERT_NE(moving.impl().poses.at(0).tree, nullptr);
  TraceRequest request = requestFor(160, 132, 150.0, {80_MHz});
  request.emitters = {EmitterSpec{.position_m = {0.045, 0.0, 0.0}, .half_angle = 60.0 * degree}};
  const Light a = trace(moving, request), b = trace(still, request);
  int differ = 0, on_ball = 0, in_shadow = 0;
  for (std::size_t p = 0; p < a.steady.size(); ++p) {
    on_ball += b.truth.range_m[p] < 1.7f ? 1 : 0;
    in_shadow += b.steady[p] == 0.0f ? 1 : 0;
    const bool is_same = std::abs(a.phasors[0][p] - b.phasors[0][p]) <= 1e-4f * std::abs(b.phasors[0][p]) + 1e-9f &&
                         std::abs(a.truth.range_m[p] - b.truth.range_m[p]) < 1e-5f;
    differ += is_same ? 0 : 1;
  }
  EXPECT_GT(on_ball, 3000);
  EXPECT_GT(in_shadow, 100);
  EXPECT_LE(differ, 8);
}

Hiding hidingOf(const std::string& shape) {
  return sceneOf("[[material]]\nname = 'm'\nalbedo = 0.5\n[[object]]\n" + shape +
                 "\nmaterial = 'm'\nvelocity_m_per_s = [1, 0, 0]\n")
      .impl()
      .poses.at(0)
      .hides;
}

/// Of a convex thing a quarter of its surface is seen on the mean (Cauchy), of the ball around it a disc. 4096 lines:
/// four standard deviations of as many that are drawn, one in 16,000 beyond.
TEST(Movers, HideSoMuchOfTheBallAroundThem) {
  const auto hides = [](const std::string& shape) { return hidingOf(shape).all; };
  const auto deviations = [](double share) { return 4.0 * std::sqrt(share * (1.0 - share) / 4096.0); };
  const double cube = 2.0 / kPi, disc = 0.5, plate = (2.0 * 1.0 + 4.0 * 0.01) / 4.0 / (kPi * (2.0 + 1e-4) / 4.0);
  EXPECT_NEAR(hides("shape = 'box'\nsize_m = [1, 1, 1]"), cube, deviations(cube));
  EXPECT_NEAR(hides("shape = 'disc'\nradius_m = 0.7"), disc, deviations(disc));
  EXPECT_GT(hides("shape = 'sphere'\nradius_m = 0.7"), 0.999);
  EXPECT_NEAR(hides("shape = 'box'\nsize_m = [1, 1, 0.01]"), plate, deviations(plate));
}

/// No line goes through the ball inside a box without meeting it; of those next to it few miss it, which 4096 lines need
/// not show at once. A plate that lines pass along has no core.
TEST(Movers, LetNothingThroughTheirCores) {
  const Hiding cube = hidingOf("shape = 'box'\nsize_m = [1, 1, 1]"), ball = hidingOf("shape = 'sphere'\nradius_m = 0.7");
  EXPECT_GE(cube.core, 0.5);
  EXPECT_LT(cube.core, 0.56);
  const double radius2 = 0.75, core2 = cube.core * cube.core;
  EXPECT_NEAR(cube.rim, (cube.all * radius2 - core2) / (radius2 - core2), 0.03);
  EXPECT_DOUBLE_EQ(ball.core, 0.7);
  EXPECT_EQ(hidingOf("shape = 'box'\nsize_m = [1, 1, 0.01]").core, 0.0);
}

}  // namespace
}  // namespace toftwin::sim::testing
