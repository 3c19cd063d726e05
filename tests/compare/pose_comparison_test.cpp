// SPDX-License-Identifier: Apache-2.0
// Single pixels: of a stack, beside a jump, between two surfaces.
#include "calib/compare/pose_comparison.h"

#include <cmath>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/compare/characteristics.h"
#include "calib/compare/statistics.h"
#include "planted_stacks.h"

namespace toftwin::compare {
namespace {

TEST(Stack, RefusesFramesOfAnotherPoseOrCamera) {
  std::mt19937_64 random{1};
  Stack stack = stackOf(camera(), tiltedWall, 0.0, 1);
  Frame moved = frame(camera(), tiltedWall, 0.0, random);
  moved.moment.world_from_camera->translation_m.z = 0.01;
  EXPECT_FALSE(stack.add(moved).ok());
  EXPECT_FALSE(stack.add(frame(camera(32, 32), tiltedWall, 0.0, random)).ok());
}

TEST(Stack, RefusesAFrameWithoutRangeOrDepth) {
  Frame empty;
  empty.source = "infrared only";
  empty.camera = camera();
  Stack stack;
  const auto added = stack.add(empty);
  ASSERT_FALSE(added.ok());
  EXPECT_THAT(added.error().message, testing::HasSubstr("infrared only"));
}

TEST(Stack, TreatsFlaggedPixelsAsInvalid) {
  std::mt19937_64 random{1};
  Frame flagged = frame(camera(), tiltedWall, 0.0, random);
  Image<std::uint8_t> flags(kWidth, kHeight);
  flags(3, 4) = static_cast<std::uint8_t>(PixelFlag::Invalid);
  flagged.planes.push_back(toPlane(PlaneKind::Flags, flags));
  Stack stack;
  ASSERT_TRUE(stack.add(flagged).ok());
  EXPECT_TRUE(std::isnan(stack.meanRange_m()(3, 4)));
  EXPECT_FALSE(std::isnan(stack.meanRange_m()(4, 4)));
}

TEST(Edges, AreFoundWithinTwoPixelsOfAJumpAndNowhereElse) {
  Image<float> range(20, 5, 1.0F);
  for (int y = 0; y < 5; ++y) {
    for (int x = 10; x < 20; ++x) range(x, y) = 2.0F;
  }
  const auto edge = edgesOf(range);
  for (int x = 0; x < 20; ++x) EXPECT_EQ(edge(x, 2), x >= 7 && x <= 12 ? 1 : 0) << x;
}

/// σ = 150 mm a frame, on walls at 1.5 m and 4.5 m: more than 3 % between neighbours is noise, the step is
/// not.
TEST(Edges, AreNotWhatNoiseMakesOfAWall) {
  std::mt19937_64 random{20261123};
  std::normal_distribution<double> noise_m{0.0, 0.15};
  for (const std::size_t frames : {std::size_t{3}, std::size_t{6}, std::size_t{30}}) {
    Image<float> mean(64, 48), noise(64, 48);
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        Running one;
        for (std::size_t i = 0; i < frames; ++i) one.add((x < 32 ? 1.5 : 4.5) + noise_m(random));
        mean(x, y) = static_cast<float>(one.mean()),
                noise(x, y) = static_cast<float>(std::sqrt(one.variance()));
      }
    }
    const Image<float> of_mean = noiseOfMean(noise, frames);
    std::vector<double> all;
    for (const float sigma : of_mean.pixels()) all.push_back(static_cast<double>(sigma));
    // The median of 25 pixels' s has a σ of 5 to 13 %, and that of thousands of them is within a few of none.
    const double truth = 0.15 / std::sqrt(static_cast<double>(frames));
    EXPECT_NEAR(quantile(std::move(all), 0.5), truth, 0.05 * truth) << frames;
    const auto edge = edgesOf(mean, of_mean), by_range_alone = edgesOf(mean);
    std::size_t missed = 0, false_edges = 0, taken_for_edges = 0;
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        const bool is_step = x >= 29 && x <= 34;
        missed += is_step && edge(x, y) == 0;
        false_edges += !is_step && edge(x, y) != 0, taken_for_edges += !is_step && by_range_alone(x, y) != 0;
      }
    }
    EXPECT_EQ(missed, 0u) << frames;
    EXPECT_EQ(false_edges, 0u) << frames;
    EXPECT_GT(taken_for_edges, 1000u) << frames;  // the test has something to tell apart
  }
  EXPECT_TRUE(std::isnan(noiseOfMean(Image<float>(4, 4, 1.0F), 1)(2, 2)));
}

TEST(FlyingPixels, HangBetweenSurfacesAndSharpEdgesHaveNone) {
  Image<float> range(20, 5, 1.0F);
  for (int y = 0; y < 5; ++y) {
    for (int x = 10; x < 20; ++x) range(x, y) = 2.0F;
  }
  const auto count = [](const Image<std::uint8_t>& image) {
    int sum = 0;
    for (const auto v : image.pixels()) sum += v;
    return sum;
  };
  EXPECT_EQ(count(flyingPixelsOf(range)), 0);
  range(10, 2) = 1.5F;
  EXPECT_EQ(flyingPixelsOf(range)(10, 2), 1);
  EXPECT_EQ(count(flyingPixelsOf(range)), 1);
}

TEST(FlyingPixels, AreNotSeenOnASlantedSurface) {
  Image<float> range(20, 5);
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 20; ++x) range(x, y) = 1.0F + 0.1F * static_cast<float>(x);
  }
  const auto flying = flyingPixelsOf(range);
  for (const auto v : flying.pixels()) EXPECT_EQ(v, 0);
}

/// A step between two walls whose first column behind the step hangs half way, in every row.
double mixedAtStep(Vec3d ray) {
  constexpr double kHalf = 0.5 / 60.0;  // half a pixel of camera()
  const double x = ray.x / ray.z;
  return std::abs(x - kHalf) < 0.5 * kHalf ? 1.12 : x < 0.0 ? 1.0 : 1.25;
}

TEST(FlyingPixels, AreCountedAmongThePixelsThatBothSee) {
  // A hangs in every row; B sees the upper half of the image only.
  const auto upper = [](Vec3d ray) {
    return ray.y < 0.0 ? mixedAtStep(ray) : std::numeric_limits<double>::quiet_NaN();
  };
  const auto pose =
      comparePose(stackOf(camera(), mixedAtStep, 0.0, 1), stackOf(camera(), upper, 0.0, 2));
  ASSERT_TRUE(pose.ok());
  const Characteristics c = characterise({*pose});
  EXPECT_EQ(c.compared, static_cast<std::size_t>(kWidth * kHeight / 2));
  EXPECT_EQ(c.flying_a, static_cast<std::size_t>(kHeight / 2));
  EXPECT_EQ(c.flying_b, static_cast<std::size_t>(kHeight / 2));
  EXPECT_EQ(c.flying_both, static_cast<std::size_t>(kHeight / 2));
}

TEST(FlyingPixels, OfAFinerCameraAreCountedAlongTheRaysOfTheOther) {
  // B: the same view with twice the pixels in both directions, its hanging column two pixels wide.
  // On its own grid it has twice the rows; along A's rays as many as A.
  const CameraInfo fine = camera(2 * kWidth, 2 * kHeight, 120.0);
  const auto pose =
      comparePose(stackOf(camera(), mixedAtStep, 0.0, 1), stackOf(fine, mixedAtStep, 0.0, 2));
  ASSERT_TRUE(pose.ok());
  const Characteristics c = characterise({*pose});
  EXPECT_EQ(c.flying_a, static_cast<std::size_t>(kHeight));
  EXPECT_GT(c.flying_b, 0U);
  EXPECT_LE(c.flying_b, static_cast<std::size_t>(kHeight));
  EXPECT_FALSE(c.flying_both.has_value());
}

TEST(SamePose, SeesTenthsOfAMillimetreAndNotRounding) {
  const Transform<World, Camera> a = rotation<World, Camera>({0, 1, 0}, 0.3);
  Transform<World, Camera> b = a;
  for (double& q : b.rotation_wxyz) q = -q;  // the same rotation
  EXPECT_TRUE(samePose(a, b));
  b.translation_m.x = 1e-4;
  EXPECT_FALSE(samePose(a, b));
  EXPECT_FALSE(samePose(a, rotation<World, Camera>({0, 1, 0}, 0.3001)));
}

}  // namespace
}  // namespace toftwin::compare
