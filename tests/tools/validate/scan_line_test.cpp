// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/scan_line.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace toftwin::validate {
namespace {

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

/// Two boards at 45° to the axis that meet 1 m before the camera: along them, a point 0.1 m to the side is 0.141 m from the edge.
TEST(PlaceOf, IsTheDistanceAlongACornersBoards) {
  const EdgePoint edge[] = {{0.0, 1000.0}};
  for (const double side : {-1.0, 1.0}) {
    const double x = side * 100.0, z = 900.0;
    EXPECT_NEAR(placeOf(edge, x / z, std::hypot(x, z)), side * 100.0 * std::numbers::sqrt2, 1e-9);
  }
}

TEST(PlaceOf, IsNothingWhereTwoEdgesHideTheReference) {
  const EdgePoint edges[] = {{-50.0, 1000.0}, {80.0, 1000.0}};
  const auto at = [&](double x) { return placeOf(edges, x / 1000.0, std::hypot(x, 1000.0)); };
  EXPECT_NEAR(at(-70.0), -20.0, 1e-9);
  EXPECT_EQ(at(0.0), 0.0);
  EXPECT_NEAR(at(95.0), 15.0, 1e-9);
}

TEST(PlaceOf, IsNotKnownWithoutAnEdge) { EXPECT_TRUE(std::isnan(placeOf({}, 0.1, 1000.0))); }

}  // namespace
}  // namespace toftwin::validate
