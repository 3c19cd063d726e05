// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/scan_line.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "calib/compare/statistics.h"

namespace toftwin::compare {
namespace {

/// A corner of `opening` degrees whose edge lies at (ex, ez), turned by `turn` degrees, walls 600
/// mm.
ScanLine cornerLine(double ex, double ez, double opening, double turn, double sigma,
                    unsigned seed) {
  const double half = opening / 2.0 * std::numbers::pi / 180.0;
  const double angle = turn * std::numbers::pi / 180.0;
  std::mt19937_64 random{seed};
  std::normal_distribution<double> noise{0.0, sigma > 0.0 ? sigma : 1.0};
  std::vector<double> x, z;
  for (const double side : {-1.0, 1.0}) {
    for (int i = 1; i <= 200; ++i) {
      const double along = 3.0 * i;
      // Walls open towards the camera, which looks along +z: direction (±sin half, −cos half),
      // turned.
      const double dx = side * std::sin(half), dz = -std::cos(half);
      const double px = ex + along * (dx * std::cos(angle) - dz * std::sin(angle));
      const double pz = ez + along * (dx * std::sin(angle) + dz * std::cos(angle));
      const double push = sigma > 0.0 ? noise(random) : 0.0;
      const double range = std::hypot(px, pz);
      x.push_back(px * (1.0 + push / range));
      z.push_back(pz * (1.0 + push / range));
    }
  }
  return toScanLine(x, z);
}

TEST(ScanLine, InterpolatesExactlyAlongAFlatWall) {
  // On a wall square to the axis z is constant, and so is its interpolation; range = z √(1 + t²).
  const std::vector<double> x{-10, 0, 10}, z{1000, 1000, 1000};
  const ScanLine line = toScanLine(x, z);
  EXPECT_NEAR(rangeAlong(line, 0.005), 1000.0 * std::sqrt(1.0 + 0.005 * 0.005), 1e-9);
  EXPECT_NEAR(rangeAlong(line, 0.01), std::hypot(10.0, 1000.0), 1e-9);
}

TEST(ScanLine, DoesNotInventRangesOutsideOrInGaps) {
  const std::vector<double> x{-100, 0, 10}, z{1000, 1000, 1000};
  const ScanLine line = toScanLine(x, z);
  EXPECT_TRUE(std::isnan(rangeAlong(line, -0.05)));  // 0.1 wide, allowed 0.02
  EXPECT_TRUE(std::isnan(rangeAlong(line, 0.011)));
  EXPECT_TRUE(std::isnan(rangeAlong(line, -0.11)));
}

TEST(ScanLine, SortsByRayAndDropsPointsBehindTheCamera) {
  const std::vector<double> x{10, -10, 0}, z{1000, 1000, -5};
  const ScanLine line = toScanLine(x, z);
  ASSERT_EQ(line.size(), 2U);
  EXPECT_LT(line.t[0], line.t[1]);
}

TEST(PlanarLine, IgnoresABoxInFrontOfTheWall) {
  std::vector<double> x, z;
  for (int i = -300; i <= 300; ++i) {
    x.push_back(i);
    z.push_back(std::abs(i) < 60 ? 850.0 : 1000.0 + 0.1 * i);
  }
  const PlanarLine wall = fitPlanarLine(x, z);
  EXPECT_NEAR(wall.rangeAlong(0.0), 1000.0, 1e-6);
  EXPECT_NEAR(-wall.normal_x / wall.normal_z, 0.1, 1e-9);
}

TEST(Corner, IsFoundExactlyWhereThereIsNoNoise) {
  const auto fit = fitCorner(cornerLine(-80, 1050, 90, 7, 0.0, 1));
  ASSERT_TRUE(fit.ok());
  EXPECT_NEAR(fit->edge_x_mm, -80.0, 1e-6);
  EXPECT_NEAR(fit->edge_z_mm, 1050.0, 1e-6);
  EXPECT_NEAR(fit->opening_deg, 90.0, 1e-7);
  EXPECT_NEAR(fit->left_length_mm, 600.0, 1e-6);
  const double t = 0.2;
  EXPECT_NEAR(fit->rangeAlong(t), rangeAlong(cornerLine(-80, 1050, 90, 7, 0.0, 1), t), 0.01);
}

TEST(Corner, IsFoundWithinItsErrorBarsUnderNoise) {
  // Range noise 1 mm on 200 points per wall at about 45° to the rays: each wall's offset and angle
  // are known to σ/√n·2 and √12 σ/(L √n); the edge is an extrapolation by half a length. 0.5 mm is
  // 5 sigma.
  constexpr unsigned kSeed = 7;
  const auto fit = fitCorner(cornerLine(40, 1200, 90, -5, 1.0, kSeed));
  ASSERT_TRUE(fit.ok());
  EXPECT_NEAR(fit->edge_x_mm, 40.0, 0.5) << "seed " << kSeed;
  EXPECT_NEAR(fit->edge_z_mm, 1200.0, 0.5) << "seed " << kSeed;
  // σ of a wall's angle: 1 mm · √12 / (600 mm · √200) = 0.0234°; two walls, 5 sigma.
  EXPECT_NEAR(fit->opening_deg, 90.0, 5.0 * 0.0234 * std::sqrt(2.0)) << "seed " << kSeed;
}

TEST(Corner, IsRefusedOnAFlatWall) {
  std::vector<double> x, z;
  for (int i = -100; i <= 100; ++i) x.push_back(i), z.push_back(1000.0);
  const auto fit = fitCorner(toScanLine(x, z));
  ASSERT_FALSE(fit.ok());
  EXPECT_NE(fit.error().message.find("corner"), std::string::npos);
}

}  // namespace
}  // namespace toftwin::compare
