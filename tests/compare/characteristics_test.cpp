// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/characteristics.h"

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "planted_stacks.h"

namespace toftwin::compare {
namespace {

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

}  // namespace
}  // namespace toftwin::compare
