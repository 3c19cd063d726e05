// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/pairs.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "sim/meshes/mesh_file.h"
#include "sim/tracer/mesh.h"
#include "tests/tracer/tracing.h"

namespace toftwin::sim::testing {
namespace {

constexpr int kSteps = 24;

/// A wall of kSteps² quadrangles over [-1, 1]², as Wavefront text; turned, each second triangle begins at another corner.
std::string wall(const std::function<double(double, double)>& z, bool is_turned) {
  std::string text;
  for (int j = 0; j <= kSteps; ++j) {
    for (int i = 0; i <= kSteps; ++i) {
      const double x = 2.0 * i / kSteps - 1.0, y = 2.0 * j / kSteps - 1.0;
      text += fmt::format("v {} {} {}\nvt {} {}\n", x, y, z(x, y), 0.5 * (x + 1.0), 0.5 * (1.0 - y));
    }
  }
  for (int j = 0; j < kSteps; ++j) {
    for (int i = 0; i < kSteps; ++i) {
      const int a = j * (kSteps + 1) + i + 1, b = a + 1, c = b + kSteps + 1, d = c - 1;
      text += fmt::format("f {0}/{0} {1}/{1} {2}/{2}\n", a, b, c);
      text += is_turned ? fmt::format("f {1}/{1} {2}/{2} {0}/{0}\n", a, c, d)
                        : fmt::format("f {0}/{0} {1}/{1} {2}/{2}\n", a, c, d);
    }
  }
  return text;
}

class Pairs : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_);
    std::ofstream{folder_ / "t.pgm", std::ios::binary} << "P5\n2 2\n255\n" << std::string{"\x40\x90\xC0\xFF", 4};
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// The light of the wall before the camera; `more` is of the object.
  [[nodiscard]] Light lightOf(const std::string& mesh, const std::string& more, const TraceRequest& request) const {
    std::ofstream{folder_ / "wall.obj"} << mesh;
    auto scene = Scene::parse("[[material]]\nname = 'm'\nalbedo = 0.8\ntexture = 't.pgm'\n[[object]]\nmesh = 'wall.obj'\n"
                              "material = 'm'\nposition_m = [0.113, 0.017, 2]\neuler_deg = [5, 11, 3]\n" + more,
                              folder_ / "scene.toml");
    if (!scene) throw std::runtime_error{scene.error().message};
    return trace(scene->at(100_ms), request);
  }

  std::filesystem::path folder_ = std::filesystem::temp_directory_path() / fmt::format("toftwin_pairs_test_{}", ::getpid());
};

TEST(PairsOfTriangles, AreKnownByTheirOrder) {
  std::vector<Vec3d> vertices;
  std::vector<Triangle> triangles;
  for (std::uint32_t i = 0; i < 500; ++i) {
    const double x = i;
    for (const Vec3d& corner : {Vec3d{x, 0, 0}, Vec3d{x, 1, 0}, Vec3d{x, 1, 1}, Vec3d{x, 0, 1}}) vertices.push_back(corner);
    triangles.push_back({4 * i, 4 * i + 1, 4 * i + 2});
    triangles.push_back({4 * i, 4 * i + 2, 4 * i + 3});
  }
  EXPECT_TRUE(areInPairs(vertices, triangles));
  EXPECT_EQ(quadranglesOf(triangles)[1], (std::array<std::uint32_t, 4>{5, 6, 7, 4}));
  auto odd = triangles;
  odd.push_back({0, 1, 2});
  EXPECT_FALSE(areInPairs(vertices, odd));
  auto turned = triangles;
  turned[501] = {1002, 1003, 1000};
  EXPECT_FALSE(areInPairs(vertices, turned));
  EXPECT_FALSE(areInPairs(vertices, {triangles.begin(), triangles.begin() + 998})) << "few triangles are not worth it";
  auto apart = triangles;
  apart[501] = {static_cast<std::uint32_t>(vertices.size()), 1002, 1003};
  vertices.push_back(vertices[1000]);
  EXPECT_TRUE(areInPairs(vertices, apart)) << "a corner of its own, in the same place";
}

TEST_F(Pairs, OfAFileAreKnown) {
  for (const bool is_turned : {false, true}) {
    std::ofstream{folder_ / "wall.obj"} << wall([](double, double) { return 0.0; }, is_turned);
    const auto read = meshes::readMeshFile(folder_ / "wall.obj");
    ASSERT_TRUE(read);
    EXPECT_EQ(areInPairs(read->mesh.vertices, read->mesh.triangles), !is_turned);
  }
}

/// Light, truth and texture are those of the same triangles without pairs. No ray goes through a corner of the mesh, where
/// either triangle is right.
TEST_F(Pairs, ShowWhatTheirTrianglesShow) {
  const auto waves = [](double x, double y) { return 0.08 * std::sin(7.0 * x) * std::cos(5.0 * y); };
  TraceRequest request = requestFor(61, 47, 60.0, {80_MHz});
  for (const std::string more : {"", "velocity_m_per_s = [0.3, 0.2, 0.1]\n"}) {
    const Light pairs = lightOf(wall(waves, false), more, request), single = lightOf(wall(waves, true), more, request);
    double largest = 0.0;
    int seen = 0;
    for (std::size_t p = 0; p < pairs.steady.size(); ++p) {
      ASSERT_EQ(std::isnan(pairs.truth.range_m[p]), std::isnan(single.truth.range_m[p])) << p;
      if (std::isnan(pairs.truth.range_m[p])) continue;
      ++seen;
      EXPECT_NEAR(pairs.truth.range_m[p], single.truth.range_m[p], 5e-7) << p;  // two units in the last place
      EXPECT_NEAR(pairs.truth.albedo[p], single.truth.albedo[p], 1e-6) << p;   // u and v: a few units, of a triangle of 8 cm
      largest = std::max(largest, std::abs(Complex{pairs.phasors[0][p] - single.phasors[0][p]}) /
                                      static_cast<double>(single.steady[p]));
    }
    EXPECT_GT(seen, 2000) << "the wall must be in sight";
    EXPECT_LT(largest, 5e-6) << "5e-7 m turn phasors by 1.7e-6 and dim them by 5e-7, and the albedo by 1.5e-6";
  }
}

/// Rays through corners, along edges and along diagonals: none slips through.
TEST_F(Pairs, AreTightAlongAllTheirEdges) {
  const std::string flat = wall([](double, double) { return 0.0; }, false);
  TraceRequest request = requestFor(2 * kSteps - 1, 2 * kSteps - 1, 2.0 * kSteps, {80_MHz});
  std::ofstream{folder_ / "wall.obj"} << flat;
  const auto scene = Scene::parse("[[material]]\nname = 'm'\n[[object]]\nmesh = 'wall.obj'\nmaterial = 'm'\n"
                                  "position_m = [0, 0, 2]\n",
                                  folder_ / "scene.toml");
  ASSERT_TRUE(scene);
  const Light light = trace(*scene, request);
  for (std::size_t p = 0; p < light.steady.size(); ++p) EXPECT_GT(light.steady[p], 0.0f) << p;
}

}  // namespace
}  // namespace toftwin::sim::testing
