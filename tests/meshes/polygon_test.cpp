// SPDX-License-Identifier: Apache-2.0
#include "sim/meshes/polygon.h"

#include <cmath>
#include <numbers>
#include <random>

#include "tests/meshes/mesh_folder.h"

namespace toftwin::sim::meshes::testing {
namespace {

double areaOfSplit(PolygonSplitter& splitter, const std::vector<Vec3d>& corners) {
  double area = 0.0;
  for (const auto& [a, b, c] : splitter.split(corners)) area += norm(cross(corners[b] - corners[a], corners[c] - corners[a])) / 2.0;
  return area;
}

/// By the sum over the edges, of a polygon in z = 0.
double areaOfOutline(const std::vector<Vec3d>& corners) {
  double twice = 0.0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3d &a = corners[i], &b = corners[(i + 1) % corners.size()];
    twice += a.x * b.y - a.y * b.x;
  }
  return std::abs(twice) / 2.0;
}

TEST(PolygonSplitter, AnyPolygonAroundAPointKeepsItsArea) {
  const unsigned seed = std::random_device{}();
  std::mt19937 random{seed};
  PolygonSplitter splitter;
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<Vec3d> corners;
    const int count = std::uniform_int_distribution{4, 60}(random);
    for (int i = 0; i < count; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / count, radius = std::uniform_real_distribution{0.1, 1.0}(random);
      corners.push_back({radius * std::cos(angle), radius * std::sin(angle), 0.0});
    }
    const double outline = areaOfOutline(corners);
    EXPECT_NEAR(areaOfSplit(splitter, corners), outline, 1e-12) << "seed " << seed << ", trial " << trial;
    for (Vec3d& p : corners) p = {p.y + 8e5, 4e5, p.x};  // in another plane, far away
    EXPECT_NEAR(areaOfSplit(splitter, corners), outline, 1e-8) << "seed " << seed << ", trial " << trial;
  }
}

TEST(PolygonSplitter, ACombKeepsItsAreaAndABridgeToAHoleDoes) {
  std::vector<Vec3d> comb{{0, 0, 0}, {100, 0, 0}};
  for (int tooth = 49; tooth >= 0; --tooth) {
    comb.push_back({2.0 * tooth + 2, 5, 0});
    comb.push_back({2.0 * tooth + 1, 1, 0});
  }
  PolygonSplitter splitter;
  EXPECT_NEAR(areaOfSplit(splitter, comb), areaOfOutline(comb), 1e-9);
  const std::vector<Vec3d> ring{{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {0, 3, 0}, {0, 0, 0}, {1, 1, 0}, {1, 2, 0}, {2, 2, 0}, {2, 1, 0}, {1, 1, 0}};
  EXPECT_NEAR(areaOfSplit(splitter, ring), 8.0, 1e-12);
}

TEST(PolygonSplitter, GivesUpOnPolygonsThatWouldTakeMinutes) {
  std::vector<Vec3d> spiral;  // flat to a line, and back over itself: hardly any ears
  for (int i = 0; i < 200'000; ++i) spiral.push_back({i % 2 == 0 ? 0.0 : 1.0, (i * 7919) % 1000 * 1e-3, 0});
  PolygonSplitter splitter;
  (void)splitter.split(spiral);
  EXPECT_TRUE(splitter.isExhausted());
}

}  // namespace
}  // namespace toftwin::sim::meshes::testing
