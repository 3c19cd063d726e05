// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/nearness.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "calib/compare/image_slopes.h"

namespace toftwin::compare {
namespace {

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
      testing::StartsWith("2 % of what both see on surfaces is over 300 mm apart, and is in none of "
                          "the other numbers. twin (B) is within"));
  EXPECT_EQ(toneOfDifference(some), Tone::Bad);
  const auto cards = nearnessCards(some, "", Tone::Good);
  EXPECT_EQ(cards.front().value, "2 %");
  EXPECT_EQ(cards.front().tone, Tone::Bad);

  const Characteristics half = characterise(withGrossPixels(100, 0));
  EXPECT_THAT(
      nearnessInWords("cam", "twin", half),
      testing::StartsWith("50 % of what both see on surfaces is over 300 mm apart, and is in none of "
                          "the other numbers; at 1 of the poses nothing else is seen. twin"));
  EXPECT_EQ(half.places, 1U) << "a pose without a pixel compared is no draw of B − A";
  EXPECT_THAT(nothingCompared(characterise(withGrossPixels(100, 100)), "pose").message,
              testing::HasSubstr("all 200 pixels that are valid in both cameras are over 300 mm apart"));
}

/// B's mean is A's, but a camera of so much less noise is no twin.
TEST(Headline, IsGreenOnlyWhereNoiseIsAlike) {
  struct Case {
    float noise_b_mm;
    bool is_alike;
  };
  for (const Case& one : {Case{0.75F, false}, {3.3F, false}, {3.4F, true}, {7.4F, true}, {7.6F, false}}) {
    std::vector<PoseComparison> poses = withGrossPixels(0, 2);
    for (PoseComparison& pose : poses) pose.noise_b_mm = Image<float>(10, 10, one.noise_b_mm);
    const Characteristics c = characterise(poses);
    EXPECT_EQ(haveLikeNoise(c), one.is_alike) << one.noise_b_mm;
    EXPECT_EQ(toneOfNearness(c), one.is_alike ? Tone::Good : Tone::Fair) << one.noise_b_mm;
    EXPECT_EQ(toneOfDifference(c), Tone::Good) << "the bias by itself";
    EXPECT_EQ(nearnessCards(c, "", Tone::Good)[2].tone, one.is_alike ? Tone::Neutral : Tone::Fair);
  }
  Characteristics unknown = characterise(withGrossPixels(0, 2));
  unknown.noise_ratio.median = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(toneOfNearness(unknown), Tone::Fair);
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

}  // namespace
}  // namespace toftwin::compare
