// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/characteristics.h"

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/compare/drift.h"
#include "calib/compare/image_slopes.h"
#include "calib/compare/nearness.h"
#include "calib/compare/statistics.h"

namespace toftwin::compare {
namespace {

constexpr int kWidth = 64, kHeight = 48, kFrames = 12;
constexpr double kSigma_m = 0.004;

CameraInfo camera(int width = kWidth, int height = kHeight, double focal = 60.0) {
  return {.width = width,
          .height = height,
          .fx = focal,
          .fy = focal,
          .cx = width / 2.0 - 0.5,
          .cy = height / 2.0 - 0.5,
          .distortion = {},
          .calibration_id = {}};
}

/// The range along each ray to what stands at depth z(x, y) in the camera's frame, plus noise.
Frame frame(const CameraInfo& info, const std::function<double(Vec3d)>& range_of_ray, double sigma,
            std::mt19937_64& random, PlaneKind kind = PlaneKind::Range) {
  std::normal_distribution<double> noise{0.0, 1.0};
  Image<float> values(info.width, info.height), amplitude(info.width, info.height);
  for (int y = 0; y < info.height; ++y) {
    for (int x = 0; x < info.width; ++x) {
      const Vec3d ray = rayThroughPixel(info, x, y).v;
      const double range = range_of_ray(ray) + (sigma > 0.0 ? sigma * noise(random) : 0.0);
      values(x, y) = static_cast<float>(kind == PlaneKind::Depth ? range * ray.z : range);
      amplitude(x, y) = static_cast<float>(1000.0 / (range * range));
    }
  }
  Frame result;
  result.source = "synthetic";
  result.camera = info;
  result.moment.world_from_camera = Transform<World, Camera>{};
  result.planes.push_back(toPlane(kind, std::move(values)));
  result.planes.push_back(toPlane(PlaneKind::Amplitude, std::move(amplitude)));
  return result;
}

double tiltedWall(Vec3d ray) { return 1.5 / (ray.z + 0.3 * ray.x); }

Stack stackOf(const CameraInfo& info, const std::function<double(Vec3d)>& scene, double sigma,
              unsigned seed) {
  std::mt19937_64 random{seed};
  Stack stack;
  for (int i = 0; i < kFrames; ++i) EXPECT_TRUE(stack.add(frame(info, scene, sigma, random)).ok());
  return stack;
}

Characteristics compareScenes(const std::function<double(Vec3d)>& a,
                              const std::function<double(Vec3d)>& b) {
  const auto pose =
      comparePose(stackOf(camera(), a, kSigma_m, 11), stackOf(camera(), b, kSigma_m, 12));
  EXPECT_TRUE(pose.ok());
  return characterise({*pose});
}

TEST(Comparison, OfTwoEqualCamerasFindsNoBias) {
  const Characteristics c = compareScenes(tiltedWall, tiltedWall);
  const Summary& all = c.regions.front().difference_mm;
  EXPECT_EQ(all.n, static_cast<std::size_t>(kWidth * kHeight));
  // The difference of two means of kFrames readings, averaged over all pixels. 4 sigma: 1 in
  // 16,000.
  const double sigma = 1e3 * kSigma_m * std::sqrt(2.0 / kFrames / (kWidth * kHeight));
  EXPECT_NEAR(all.mean, 0.0, 4.0 * sigma);
  EXPECT_TRUE(std::isnan(all.standard_error));  // one pose says nothing of how poses differ
}

TEST(Comparison, FindsAPlantedTenMillimetres) {
  const Characteristics c =
      compareScenes(tiltedWall, [](Vec3d ray) { return tiltedWall(ray) + 0.010; });
  const Summary& all = c.regions.front().difference_mm;
  EXPECT_NEAR(all.mean, 10.0, 4.0 * 1e3 * kSigma_m * std::sqrt(2.0 / kFrames / (kWidth * kHeight)));
}

/// A wall whose range goes through 1 m within the noise: by A's own range, pixels that A reads too near would be in
/// the nearer class, and B − A too large there, by some 20 mm.
TEST(Comparison, ClassesByARangeThatDoesNotGoWithTheDifference) {
  constexpr double kNoise_m = 0.1;
  const auto wall = [](Vec3d) { return 1.0; };
  for (const double of_b : {1.0, 0.3}) {
    std::mt19937_64 random{17};
    Stack a, b;
    for (int i = 0; i < kFrames; ++i) {
      ASSERT_TRUE(a.add(frame(camera(), wall, kNoise_m, random)).ok());
      ASSERT_TRUE(b.add(frame(camera(), wall, of_b * kNoise_m, random)).ok());
    }
    const auto pose = comparePose(a, b);
    ASSERT_TRUE(pose.ok());
    int classes = 0;
    for (const Region& region : characterise({*pose}).regions) {
      if (!region.name.starts_with("range ")) continue;
      ++classes;
      const double sigma = 1e3 * kNoise_m * std::hypot(1.0, of_b) / std::sqrt(kFrames);
      EXPECT_NEAR(region.difference_mm.mean, 0.0,
                  4.0 * sigma / std::sqrt(static_cast<double>(region.difference_mm.n)))
          << region.name << ", noise of B " << of_b;
    }
    EXPECT_EQ(classes, 2);
  }
}

TEST(Comparison, MeasuresTheTemporalNoiseOfEachCamera) {
  std::mt19937_64 random{5};
  Stack a, b;
  for (int i = 0; i < kFrames; ++i) {
    ASSERT_TRUE(a.add(frame(camera(), tiltedWall, kSigma_m, random)).ok());
    ASSERT_TRUE(b.add(frame(camera(), tiltedWall, 2.0 * kSigma_m, random)).ok());
  }
  const auto pose = comparePose(a, b);
  ASSERT_TRUE(pose.ok());
  // The median of a sample standard deviation of 12 values is 0.970 sigma (chi with 11 degrees of
  // freedom); over 3072 pixels its own error is about 0.5 %. 4 sigma: 2 %.
  const Region all = characterise({*pose}).regions.front();
  EXPECT_NEAR(all.noise_a_mm, 0.970 * 4.0, 0.02 * 4.0);
  EXPECT_NEAR(all.noise_b_mm, 0.970 * 8.0, 0.02 * 8.0);
}

TEST(Comparison, OfDepthAndRangeIsAlongTheSameRay) {
  std::mt19937_64 random{1};
  Stack range, depth;
  ASSERT_TRUE(range.add(frame(camera(), tiltedWall, 0.0, random)).ok());
  ASSERT_TRUE(depth.add(frame(camera(), tiltedWall, 0.0, random, PlaneKind::Depth)).ok());
  const auto pose = comparePose(range, depth);
  ASSERT_TRUE(pose.ok());
  // Float32 at 2 m steps by 0.24 µm; two roundings and a product.
  EXPECT_LT(characterise({*pose}).regions.front().difference_mm.p95_abs, 1e-3);
}

TEST(Comparison, OfDifferentCamerasInterpolatesAlongTheSameRay) {
  std::mt19937_64 random{1};
  Stack a, b;
  ASSERT_TRUE(a.add(frame(camera(), tiltedWall, 0.0, random)).ok());
  ASSERT_TRUE(b.add(frame(camera(90, 70, 77.0), tiltedWall, 0.0, random)).ok());
  const auto pose = comparePose(a, b);
  ASSERT_TRUE(pose.ok()) << pose.error().message;
  EXPECT_TRUE(pose->resampled);
  EXPECT_NE(resamplingNote(*pose).find("B is interpolated to A's rays"), std::string::npos);
  const Characteristics c = characterise({*pose});
  EXPECT_GT(c.pixels, static_cast<std::size_t>(kWidth * kHeight) / 2);
  // Inverse depth is linear on a plane: only float rounding remains.
  EXPECT_LT(std::max(-c.regions.front().difference_mm.min, c.regions.front().difference_mm.max),
            2e-3);
}

TEST(Comparison, DoesNotInterpolateAcrossAJump) {
  const auto step = [](Vec3d ray) { return (ray.x < 0.0 ? 1.0 : 2.0) / ray.z; };
  std::mt19937_64 random{1};
  Stack a, b;
  ASSERT_TRUE(a.add(frame(camera(), step, 0.0, random)).ok());
  ASSERT_TRUE(b.add(frame(camera(90, 70, 77.0), step, 0.0, random)).ok());
  const auto pose = comparePose(a, b);
  ASSERT_TRUE(pose.ok());
  for (const float d : pose->difference_mm.pixels()) {
    if (std::isfinite(d)) {
      EXPECT_LT(std::abs(d), 0.01F);
    }
  }
}

TEST(Comparison, RefusesDifferentPoses) {
  std::mt19937_64 random{1};
  Frame moved = frame(camera(), tiltedWall, 0.0, random);
  moved.moment.world_from_camera->translation_m.x = 0.002;
  Stack a = stackOf(camera(), tiltedWall, 0.0, 1), b;
  ASSERT_TRUE(b.add(moved).ok());
  const auto pose = comparePose(a, b);
  ASSERT_FALSE(pose.ok());
  EXPECT_THAT(pose.error().message, testing::HasSubstr("2.000 mm"));
}

TEST(Comparison, RefusesCamerasThatShareNoRays) {
  std::mt19937_64 random{1};
  CameraInfo aside = camera();
  aside.cx = 5000.0;  // looks far to the left of everything that A sees
  Stack a = stackOf(camera(), tiltedWall, 0.0, 1), b;
  ASSERT_TRUE(b.add(frame(
                        aside, [](Vec3d) { return 1.0; }, 0.0, random))
                  .ok());
  const auto pose = comparePose(a, b);
  ASSERT_FALSE(pose.ok());
  EXPECT_THAT(pose.error().message, testing::HasSubstr("too few to compare"));
}

TEST(Comparison, ComparesValidityMasks) {
  std::mt19937_64 random{1};
  const auto half = [](Vec3d ray) {
    return ray.x < 0.0 ? std::numeric_limits<double>::quiet_NaN() : 1.0;
  };
  Stack a = stackOf(camera(), tiltedWall, 0.0, 1), b;
  ASSERT_TRUE(b.add(frame(camera(), half, 0.0, random)).ok());
  const auto pose = comparePose(a, b);
  ASSERT_TRUE(pose.ok());
  const Characteristics c = characterise({*pose});
  EXPECT_DOUBLE_EQ(c.valid_a, 1.0);
  EXPECT_DOUBLE_EQ(c.valid_b, 0.5);
  EXPECT_DOUBLE_EQ(c.mask_agreement, 0.5);
  EXPECT_DOUBLE_EQ(c.mask_overlap, 0.5);
}

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

/// Its numbers are those of surfaces; where those are less than half of the pixels, it says of how many.
TEST(Headline, SaysHowManyPixelsItIsOfWhereTheyAreLessThanHalf) {
  Characteristics c;
  c.regions = {Region{.name = "all pixels", .difference_mm = {.n = 1000, .mean = 40.0, .p95_abs = 90.0}},
               Region{.name = "surfaces",
                      .difference_mm = {.n = 500, .mean = -2.5, .standard_error = 0.25, .p95_abs = 7.0}}};
  c.noise_ratio.median = 1.5;
  EXPECT_EQ(
      nearnessInWords("cam", "twin", c),
      "twin (B) is within 7.0 mm of cam (A) for 95 % of the pixels on surfaces; on average it reads 2.50 ± "
      "0.25 mm nearer, and its noise is 1.50 times A's");
  c.regions[1].difference_mm.n = 499, c.regions[1].difference_mm.mean = 2.5;
  EXPECT_EQ(nearnessInWords("cam", "twin", c),
            "twin (B) is within 7.0 mm of cam (A) for 95 % of the pixels on surfaces, which are only 499 of "
            "all 1000 "
            "pixels compared; on average it reads 2.50 ± 0.25 mm farther, and its noise is 1.50 times A's");
}

/// Two poses of 10 × 10 pixels, valid in both, at which B is so much farther in a part of them.
std::vector<PoseComparison> withGrossPixels(std::size_t at_first, std::size_t at_second) {
  std::vector<PoseComparison> poses;
  for (const std::size_t gross : {at_first, at_second}) {
    PoseComparison pose;
    pose.range_a_mm = Image<float>(10, 10, 3000.0F), pose.difference_mm = Image<float>(10, 10, 2.0F);
    pose.noise_a_mm = pose.noise_b_mm = Image<float>(10, 10, 5.0F);
    pose.valid_a = pose.valid_b = Image<float>(10, 10, 1.0F);
    pose.edge = pose.flying_a = pose.flying_b = Image<std::uint8_t>(10, 10);
    for (std::size_t i = 0; i < gross; ++i) pose.difference_mm[i] = -2500.0F;
    poses.push_back(std::move(pose));
  }
  return poses;
}

TEST(Headline, BeginsWithPixelsThatAreFartherApartThanWhatItTells) {
  const Characteristics none = characterise(withGrossPixels(0, 2));
  EXPECT_THAT(nearnessInWords("cam", "twin", none), testing::StartsWith("twin (B) is within"));
  EXPECT_EQ(toneOfDifference(none), Tone::Good);
  EXPECT_EQ(nearnessCards(none, "", Tone::Good).size(), 4u);

  const Characteristics some = characterise(withGrossPixels(0, 4));
  EXPECT_THAT(
      nearnessInWords("cam", "twin", some),
      testing::StartsWith("2 % of what both see on surfaces is over 300 mm apart, and in no number of "
                          "the rest. twin (B) is within"));
  EXPECT_EQ(toneOfDifference(some), Tone::Bad);
  const auto cards = nearnessCards(some, "", Tone::Good);
  EXPECT_EQ(cards.front().value, "2 %");
  EXPECT_EQ(cards.front().tone, Tone::Bad);

  const Characteristics half = characterise(withGrossPixels(100, 0));
  EXPECT_THAT(
      nearnessInWords("cam", "twin", half),
      testing::StartsWith("50 % of what both see on surfaces is over 300 mm apart, and in no number of "
                          "the rest; at 1 of the poses nothing else is seen. twin"));
  EXPECT_EQ(half.places, 1U) << "a pose without a pixel compared is no draw of B − A";
  EXPECT_THAT(nothingCompared(characterise(withGrossPixels(100, 100)), "pose").message,
              testing::HasSubstr("all 200 pixels that are valid in both cameras are over 300 mm apart"));
}

/// 40 mm from top to bottom, beside noise of 5: as a mean B is as far as A.
TEST(Headline, SaysThatOneSideOfTheImageIsFartherAndIsNotGreen) {
  for (const double down_mm : {40.0, 4.0}) {
    std::vector<PoseComparison> poses = withGrossPixels(0, 2);
    for (PoseComparison& pose : poses) {
      for (int y = 0; y < 10; ++y) {
        for (int x = 0; x < 10; ++x)
          pose.difference_mm(x, y) = static_cast<float>(down_mm * ((y + 0.5) / 10.0 - 0.5));
      }
    }
    const Characteristics c = characterise(poses);
    const Tilt tilt{poses};
    EXPECT_NEAR(tilt.edge_mm(), 0.5 * down_mm, 1e-5);
    const bool is_tilted = down_mm > 10.0;
    EXPECT_EQ(toneOfDifference(c, tilt.edge_mm()), is_tilted ? Tone::Bad : Tone::Good);
    EXPECT_EQ(tilt.words(mainRegionOf(c).noise_a_mm),
              is_tilted ? "; from the top of the image to the bottom it goes by 40.0 mm" : "");
  }
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

TEST(Comparison, CountsWrongPeriodsApartFromTheBias) {
  // One pixel in 3072 one period of 625 mm off: 0.2 mm of bias if it were averaged in.
  const auto wrapped = [](Vec3d ray) {
    return tiltedWall(ray) +
           (ray.x > 0.0 && ray.x < 0.02 && ray.y > 0.0 && ray.y < 0.02 ? 0.625 : 0.0);
  };
  std::mt19937_64 random{1};
  Stack a, b;
  ASSERT_TRUE(a.add(frame(camera(), tiltedWall, 0.0, random)).ok());
  ASSERT_TRUE(b.add(frame(camera(), wrapped, 0.0, random)).ok());
  const Characteristics c = characterise({*comparePose(a, b)});
  EXPECT_EQ(c.gross, 1U);
  EXPECT_NEAR(c.regions.front().difference_mm.mean, 0.0, 1e-6);
}

TEST(Comparison, LeavesAGrossPixelOutOfAllButTheMasks) {
  // One pixel of B a period of 625 mm off, beside a step, and five times as bright and noisy there as
  // anywhere else: all of that belongs to another surface.
  const auto step = [](Vec3d ray) { return ray.x < 0.0 ? 1.0 : 2.0; };
  std::mt19937_64 random{1};
  Stack a, b;
  const auto add = [&](Stack& stack, double noise_m, bool is_off) {
    Frame f = frame(camera(), step, 0.0, random);
    Image<float> range(kWidth, kHeight), amplitude(kWidth, kHeight, 10.0F);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x)
        range(x, y) = static_cast<float>((x < kWidth / 2 ? 1.0 : 2.0) + noise_m);
    }
    if (is_off) range(kWidth / 2, 20) += static_cast<float>(0.625 + 4.0 * noise_m);
    if (is_off) amplitude(kWidth / 2, 20) = 50.0F;
    f.planes = {toPlane(PlaneKind::Range, range), toPlane(PlaneKind::Amplitude, amplitude)};
    ASSERT_TRUE(stack.add(f).ok());
  };
  for (const double noise_m : {-0.001, 0.001}) add(a, noise_m, false), add(b, noise_m, true);
  const Characteristics c = characterise({*comparePose(a, b)});
  constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;
  EXPECT_EQ(c.gross, 1U);
  EXPECT_EQ(c.pixels, kPixels);
  EXPECT_DOUBLE_EQ(c.mask_agreement, 1.0);
  EXPECT_EQ(c.compared, kPixels - 1);
  EXPECT_EQ(c.regions.front().difference_mm.n, kPixels - 1);
  EXPECT_EQ(c.amplitude_ratio.n, kPixels - 1);
  EXPECT_DOUBLE_EQ(c.amplitude_ratio.max, 1.0);
  EXPECT_EQ(c.noise_ratio.n, kPixels - 1);
  EXPECT_NEAR(c.noise_ratio.max, 1.0, 1e-3);  // float32 at 2 m: 0.24 µm of 1 mm
  EXPECT_EQ(c.flying_b, 0U);
}

TEST(Comparison, TakesNoiseOnlyWhereHalfOfTheFramesAreValid) {
  // B sees one pixel in two of twelve frames.
  std::mt19937_64 random{3};
  Stack a = stackOf(camera(), tiltedWall, kSigma_m, 11), b;
  for (int i = 0; i < kFrames; ++i) {
    Frame f = frame(camera(), tiltedWall, kSigma_m, random);
    Image<std::uint8_t> flags(kWidth, kHeight);
    if (i >= 2) flags(5, 5) = static_cast<std::uint8_t>(PixelFlag::Invalid);
    f.planes.push_back(toPlane(PlaneKind::Flags, flags));
    ASSERT_TRUE(b.add(f).ok());
  }
  const Characteristics c = characterise({*comparePose(a, b)});
  EXPECT_EQ(c.noise_ratio.n, static_cast<std::size_t>(kWidth * kHeight - 1));
  EXPECT_EQ(c.amplitude_ratio.n, static_cast<std::size_t>(kWidth * kHeight - 1));
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

/// Two cameras at a pose, the second one off by so much.
PoseComparison poseOffBy(double bias_m, double x_m, unsigned seed) {
  Stack a, b;
  std::mt19937_64 random{seed};
  for (int i = 0; i < kFrames; ++i) {
    Frame fa = frame(camera(), tiltedWall, kSigma_m, random);
    Frame fb = frame(
        camera(), [&](Vec3d ray) { return tiltedWall(ray) + bias_m; }, kSigma_m, random);
    fa.moment.world_from_camera->translation_m.x = x_m;
    fb.moment.world_from_camera->translation_m.x = x_m;
    EXPECT_TRUE(a.add(fa).ok() && b.add(fb).ok());
  }
  return *comparePose(a, b);
}

/// Of one pose's mean: the noise of all its pixels, in mm.
const double kMeanError_mm = 1e3 * kSigma_m * std::sqrt(2.0 / kFrames / (kWidth * kHeight));

TEST(Places, OfAPoseVisitedTwiceAreOne) {
  const std::vector<PoseComparison> poses{poseOffBy(0.0, 0.0, 1), poseOffBy(0.0, 0.1, 2),
                                          poseOffBy(0.0, 0.0, 3)};
  EXPECT_EQ(placesOf(poses), (std::vector<std::uint32_t>{0, 1, 0}));
  EXPECT_EQ(characterise(poses).places, 2U);
}

TEST(Places, OfUnknownPosesAreEachTheirOwn) {
  std::vector<PoseComparison> poses(2);
  EXPECT_EQ(placesOf(poses), (std::vector<std::uint32_t>{0, 1}));
}

TEST(Comparison, TellsTheErrorOverPosesAndNotOverPixels) {
  // 0, 3 and 6 mm at three poses: s = 3 mm, so 3/√3, to the noise of the poses' means. 4 σ.
  const Characteristics c =
      characterise({poseOffBy(0.0, 0.0, 1), poseOffBy(0.003, 0.1, 2), poseOffBy(0.006, 0.2, 3)});
  EXPECT_NEAR(c.regions.front().difference_mm.standard_error, std::sqrt(3.0), 4.0 * kMeanError_mm);
  EXPECT_TRUE(std::isfinite(c.noise_ratio.standard_error));
}

TEST(Comparison, DoesNotTakeAPoseVisitedAgainAsAnother) {
  // Means 0, 3 and again 0 mm: the places' means are 0 and 3, s = 3/√2, weights 2/3 and 1/3:
  // error = 3/√2 · √5/3. Three independent poses would give √3/√3 = 1.
  const Characteristics c =
      characterise({poseOffBy(0.0, 0.0, 1), poseOffBy(0.003, 0.1, 2), poseOffBy(0.0, 0.0, 3)});
  EXPECT_NEAR(c.regions.front().difference_mm.standard_error, std::sqrt(2.5), 4.0 * kMeanError_mm);
}

TEST(Drift, IsWhatChangedBetweenTwoVisitsOfOnePose) {
  const std::vector<PoseComparison> poses{poseOffBy(0.001, 0.0, 1), poseOffBy(0.009, 0.1, 2),
                                          poseOffBy(0.003, 0.0, 3)};
  const auto drifts = driftsOf(poses);
  ASSERT_EQ(drifts.size(), 1U);
  EXPECT_EQ(drifts[0].first, 0U);
  EXPECT_EQ(drifts[0].last, 2U);
  EXPECT_EQ(drifts[0].pixels, static_cast<std::size_t>(kWidth * kHeight));
  // A difference of two means, each of the noise above: 4 σ is 1 in 16,000 for other seeds.
  EXPECT_NEAR(drifts[0].difference_mm, 2.0, 4.0 * std::sqrt(2.0) * kMeanError_mm);
  EXPECT_NEAR(drifts[0].b_mm - drifts[0].a_mm, drifts[0].difference_mm, 1e-9);
  EXPECT_NEAR(drifts[0].a_mm, 0.0, 4.0 * kMeanError_mm);
  // Independent pixels: at least sd/√n (known to 1.3 %), and at most 4 times 27 % of 8 blocks over it.
  EXPECT_GT(drifts[0].error_mm, 0.94 * std::sqrt(2.0) * kMeanError_mm);
  EXPECT_LT(drifts[0].error_mm, 2.1 * std::sqrt(2.0) * kMeanError_mm);
}

TEST(Drift, IsNotToldWhereNoPoseComesAgain) {
  EXPECT_TRUE(driftsOf({poseOffBy(0.001, 0.0, 1), poseOffBy(0.009, 0.1, 2)}).empty());
}

TEST(Trend, HasNoErrorWhereOnlyOnePlaceIsSeen) {
  const Trend trend = trendOf({1, 2, 3, 4}, {10, 14, 20, 30}, {0, 1, 1, 1}, 2);
  // Two places with one value each: s = 4/√2, error = s/√2 = 2.
  EXPECT_DOUBLE_EQ(trend.low[0], 12.0 - 4.0);
  EXPECT_DOUBLE_EQ(trend.high[0], 12.0 + 4.0);
  EXPECT_TRUE(std::isnan(trend.low[1]));
}

TEST(Trend, GivesTheMeanOfEachEquallyFilledBin) {
  const Trend trend = trendOf({4, 1, 2, 3}, {40, 10, 20, 30}, {0, 0, 1, 1}, 2);
  EXPECT_EQ(trend.x, (std::vector<double>{1.5, 3.5}));
  EXPECT_EQ(trend.y, (std::vector<double>{15, 35}));
}

/// Means of 12 readings of 0.4 m noise on either side differ by 163 mm of noise, and by 120 mm. Cut at 300 mm
/// about 0, a normal one's mean would be 120 − 163 (φ(1.10) − φ(2.57)) / (Φ(1.10) + Φ(2.57) − 1) = 81 mm.
/// What is left when it is cut about its own mean has sd 138 mm and is found 1/(1 − 0.29) times as
/// uncertain: 3.6 mm of 3072 pixels.
TEST(Comparison, IsNotShiftedByTheCutWhereNoiseIsLarge) {
  const auto far = [](Vec3d ray) { return 2.0 * tiltedWall(ray); };
  const auto farther = [&](Vec3d ray) { return far(ray) + 0.12; };
  const auto pose = comparePose(stackOf(camera(), far, 0.4, 21), stackOf(camera(), farther, 0.4, 22));
  ASSERT_TRUE(pose.ok());
  EXPECT_NEAR(characterise({*pose}).regions.front().difference_mm.mean, 120.0, 4.0 * 3.6);
  // Where it is small the cut stays where it is, whatever the bias.
  const auto clear = comparePose(stackOf(camera(), far, 0.004, 21), stackOf(camera(), farther, 0.004, 22));
  EXPECT_EQ(clear->middle_mm, 0.0);
}

/// Means that differ by 60 mm of noise and by 450 mm: 0.62 % of 3072 pixels, 19 ± 4.4, are within 300 mm of 0
/// by noise. The cut does not go after them.
TEST(Comparison, CountsAnotherSurfaceAsGrossHoweverNoisyItIs) {
  const auto far = [](Vec3d ray) { return 2.0 * tiltedWall(ray); };
  const auto other = [&](Vec3d ray) { return far(ray) + 0.45; };
  const double sigma_m = 0.06 * std::sqrt(0.5 * kFrames);
  const auto pose = comparePose(stackOf(camera(), far, sigma_m, 23), stackOf(camera(), other, sigma_m, 24));
  ASSERT_TRUE(pose.ok());
  EXPECT_EQ(pose->middle_mm, 0.0);
  const Characteristics c = characterise({*pose});
  EXPECT_NEAR(static_cast<double>(c.gross), 3072.0 - 19.0, 4.0 * 4.4);
}

/// Means of 12 readings of 105 mm of noise differ by 43 mm of it, too little to move the cut; of the six that
/// are valid by 61 mm, enough. The cut's middle is then found to 61/√3072 = 1.1 mm.
TEST(Comparison, TakesTheNoiseOfTheFramesThatAreValid) {
  const auto far = [](Vec3d ray) { return 2.0 * tiltedWall(ray); };
  const auto none = [](Vec3d) { return std::nan(""); };
  const auto stackWith = [&](double off_m, int every, unsigned seed) {
    std::mt19937_64 random{seed};
    const auto scene = [&](Vec3d ray) { return far(ray) + off_m; };
    Stack stack;
    for (int i = 0; i < kFrames; ++i) {
      const bool is_valid = i % every == 0;
      EXPECT_TRUE(
          stack.add(is_valid ? frame(camera(), scene, 0.105, random) : frame(camera(), none, 0.105, random)));
    }
    return stack;
  };
  const auto half = comparePose(stackWith(0.0, 2, 25), stackWith(0.1, 2, 26));
  const auto whole = comparePose(stackWith(0.0, 1, 25), stackWith(0.1, 1, 26));
  ASSERT_TRUE(half.ok() && whole.ok());
  EXPECT_NEAR(half->middle_mm, 100.0, 4.0 * 1.1);
  EXPECT_EQ(whole->middle_mm, 0.0);
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
