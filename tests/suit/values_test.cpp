// SPDX-License-Identifier: Apache-2.0
// What frames come to, and the intervals of it.
#include "calib/suit/values.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "cases.h"

namespace toftwin::suit {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

struct Row {
  Seen seen;
  std::vector<std::uint32_t> pixels;
  std::vector<Image<float>> frames;
};

/// Four pixels at 1 m, in two frames: errors +5 and +5, −20 and invalid, invalid twice, 0 and 2 mm.
Row fourPixels() {
  Row row{.seen = {.range_m = Image<float>(4, 1, 1.0f),
                   .object = Image<std::int32_t>(4, 1, 0),
                   .point_m = Image<Vec3f>(4, 1)},
          .pixels = {0, 1, 2, 3},
          .frames = {Image<float>(4, 1), Image<float>(4, 1)}};
  const float first[]{1.005f, 0.980f, kNaN, 1.0f}, second[]{1.005f, kNaN, kNaN, 1.002f};
  for (std::size_t i = 0; i < 4; ++i) {
    row.frames[0][i] = first[i];
    row.frames[1][i] = second[i];
  }
  return row;
}

double valueOf(RequirementSpec requirement, const Row& row) {
  return valueOf(requirement, row.seen, row.pixels, row.frames);
}

TEST(Value, OfSharesCountsPixelsAndFramesAndInvalidOnesAsNotAccurate) {
  const Row row = fourPixels();
  EXPECT_DOUBLE_EQ(valueOf({.kind = Kind::Accuracy, .within = 6_mm}, row), 4.0 / 8.0);
  EXPECT_DOUBLE_EQ(valueOf({.kind = Kind::Accuracy, .within = 3_mm}, row), 2.0 / 8.0);
  EXPECT_DOUBLE_EQ(valueOf({.kind = Kind::Valid}, row), 5.0 / 8.0);
  EXPECT_DOUBLE_EQ(valueOf({.kind = Kind::Phantom, .within = 10_mm}, row), 1.0 / 8.0);
  EXPECT_DOUBLE_EQ(valueOf({.kind = Kind::Pixels}, row), 4.0);
}

TEST(Value, OfMissedIsTheShareOfFramesWithTooFewAccuratePixels) {
  const Row row = fourPixels();
  EXPECT_DOUBLE_EQ(valueOf({.kind = Kind::Missed, .within = 30_mm, .pixels = 2}, row), 0.0);
  EXPECT_DOUBLE_EQ(valueOf({.kind = Kind::Missed, .within = 30_mm, .pixels = 3}, row), 0.5);
  EXPECT_DOUBLE_EQ(valueOf({.kind = Kind::Missed, .within = 30_mm, .pixels = 4}, row), 1.0);
}

/// Means over frames are 5, −20 and 1 mm; floats at 1 m are 6e-8 m apart, 6e-5 mm.
TEST(Value, OfBiasIsTheMedianOfThePixelsMeans) {
  EXPECT_NEAR(valueOf({.kind = Kind::Bias}, fourPixels()), 1.0, 2e-4);
}

/// 4000 pixels, four frames, σ = 8 mm. The median of 4000 variances has a relative error of 1.2 %, so σ of
/// 0.6 %: 3 % are five standard errors, false alarm 6e-7. Uncorrected, the median would be 11 % low.
TEST(Value, OfNoiseDoesNotDependOnHowFewFramesThereAre) {
  std::mt19937_64 random{7};
  std::normal_distribution<float> noise{1.0f, 0.008f};
  Row row{.seen = {.range_m = Image<float>(4000, 1, 1.0f),
                   .object = Image<std::int32_t>(4000, 1, 0),
                   .point_m = {}},
          .pixels = {},
          .frames = {}};
  for (std::uint32_t i = 0; i < 4000; ++i) row.pixels.push_back(i);
  for (int f = 0; f < 4; ++f) {
    auto& frame = row.frames.emplace_back(4000, 1);
    for (float& value : frame.pixels()) value = noise(random);
  }
  EXPECT_NEAR(valueOf({.kind = Kind::Noise}, row), 8.0, 0.24);
}

/// Three repeats: t(0.975, 2) = 4.30265; sd/√3 of 1, 2, 3 is 1/√3.
TEST(Interval, IsStudentsAndWidenedByWhatThePathsStillMove) {
  const std::vector<double> repeats{1.0, 2.0, 3.0};
  const Estimate alone = estimateOf(repeats, std::nullopt, false);
  EXPECT_DOUBLE_EQ(alone.value, 2.0);
  EXPECT_NEAR(alone.high - alone.value, 4.30265 / std::sqrt(3.0), 1e-5);
  const Estimate together = estimateOf(repeats, 2.4, false);
  EXPECT_DOUBLE_EQ(together.value, 2.4);
  EXPECT_NEAR(together.high - together.value, 4.30265 / std::sqrt(3.0) + 0.4 / 2.0, 1e-5);
}

TEST(Interval, OfAShareStaysWithinZeroAndOne) {
  const std::vector<double> repeats{0.9, 1.0, 0.95};
  const Estimate estimate = estimateOf(repeats, std::nullopt, true);
  EXPECT_EQ(estimate.high, 1.0);
  EXPECT_GT(estimate.low, 0.0);
}

/// No event in 60: (1 − p)⁶⁰ = 0.05. One in ten: the tabulated interval 0.25 % to 44.50 %.
TEST(Interval, OfEventsIsCloppersAndPearsons) {
  EXPECT_NEAR(shareOf(0, 60).high, 1.0 - std::pow(0.05, 1.0 / 60.0), 1e-12);
  EXPECT_EQ(shareOf(0, 60).low, 0.0);
  EXPECT_NEAR(shareOf(60, 60).low, std::pow(0.05, 1.0 / 60.0), 1e-12);
  EXPECT_NEAR(shareOf(1, 10).low, 0.0025, 5e-5);
  EXPECT_NEAR(shareOf(1, 10).high, 0.4450, 5e-5);
}

/// 2000 runs of three normal repeats: 95 % ± 4 · 0.49 %, false alarm 6e-5.
TEST(Interval, HoldsTheTruthIn95PercentOfRuns) {
  std::mt19937_64 random{11};
  std::normal_distribution<double> noise{5.0, 2.0};
  int held = 0;
  for (int run = 0; run < 2000; ++run) {
    const std::vector<double> repeats{noise(random), noise(random), noise(random)};
    const Estimate estimate = estimateOf(repeats, std::nullopt, false);
    held += estimate.low <= 5.0 && 5.0 <= estimate.high;
  }
  EXPECT_NEAR(held / 2000.0, 0.95, 0.0195);
}

TEST(Verdict, IsCertainOnlyIfTheWholeIntervalIsOnOneSide) {
  const RequirementSpec most{.kind = Kind::Bias, .at_most = 10_mm};
  const auto verdict = [&](double value, double low, double high) {
    return verdictOf(most, {.value = value, .low = low, .high = high, .repeats = 3});
  };
  EXPECT_TRUE(verdict(5, 4, 6).is_met && verdict(5, 4, 6).is_certain);
  EXPECT_TRUE(verdict(5, -11, 21).is_met);
  EXPECT_FALSE(verdict(5, -11, 21).is_certain);
  EXPECT_FALSE(verdict(-12, -13, -11).is_met);
  EXPECT_TRUE(verdict(-12, -13, -11).is_certain);
  EXPECT_DOUBLE_EQ(verdict(-12, -13, -11).margin, -2.0);
  EXPECT_FALSE(verdict(12, 9, 15).is_certain);
}

/// None missed in so many frames does not prove that none ever will be.
TEST(Verdict, OfNoneMissedIsMetAndNotCertain) {
  const RequirementSpec never{.kind = Kind::Missed, .at_most_percent = 0.0},
      rarely{.kind = Kind::Missed, .at_most_percent = 6.0};
  EXPECT_TRUE(verdictOf(never, shareOf(0, 60)).is_met);
  EXPECT_FALSE(verdictOf(never, shareOf(0, 60)).is_certain);
  EXPECT_TRUE(verdictOf(rarely, shareOf(0, 60)).is_certain);
}

}  // namespace
}  // namespace toftwin::suit
