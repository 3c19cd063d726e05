// SPDX-License-Identifier: Apache-2.0
// Frames that differ from the others that were taken with them.
#include <cmath>
#include <random>

#include <gmock/gmock.h>

#include "calib/discover/campaign/frames_apart.h"
#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

/// Captures of eight frames, numbered on by the source with gaps between captures, whose noise differs from capture to
/// capture.
std::vector<MeasuredCapture> noisy(std::uint64_t seed, const std::function<double(std::uint64_t, std::size_t)>& late_mm,
                                   std::size_t count = 30) {
  std::mt19937_64 random{seed};
  std::normal_distribution<double> normal;
  std::vector<MeasuredCapture> captures(count);
  std::uint64_t sequence = 0;
  for (std::size_t c = 0; c < captures.size(); ++c) {
    const double noise_mm = 0.1 * static_cast<double>(1 + c % 5);
    sequence += c % 3;
    for (std::size_t k = 0; k < 8; ++k, ++sequence)
      captures[c].each.push_back({sequence, 1500.0 + late_mm(sequence, k) + noise_mm * normal(random), normal(random)});
  }
  return captures;
}

double nothing(std::uint64_t, std::size_t) { return 0.0; }

/// One in 500 seeds is told wrongly: four or more of 100 are so once in 20,000.
TEST(FramesApart, FramesThatAreAlikeAreNotApart) {
  int told = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) told += framesApart(noisy(seed, nothing), seed) ? 1 : 0;
  EXPECT_LE(told, 3);
}

TEST(FramesApart, EverySecondIsNoMinority) {
  const auto apart = framesApart(
      noisy(1, [](std::uint64_t sequence, std::size_t) { return sequence % 2 == 0 ? 0.3 : -0.3; }), 1);
  ASSERT_TRUE(apart);
  EXPECT_EQ(apart->which.period, 2U);
  EXPECT_FALSE(apart->isMinority());
  EXPECT_EQ(apart->inWords(), "every 2nd frame");
  EXPECT_NEAR(std::abs(apart->range_mm.mean), 0.6, 4.0 * apart->range_mm.error);
  EXPECT_LT(apart->range_mm.error, 0.06);
}

TEST(FramesApart, OneInSevenIsFoundByTheSourcesNumbers) {
  const auto apart =
      framesApart(noisy(2, [](std::uint64_t sequence, std::size_t) { return sequence % 7 == 3 ? 0.6 : 0.0; }), 1);
  ASSERT_TRUE(apart);
  EXPECT_EQ(apart->which.period, 7U);
  EXPECT_EQ(apart->which.rest, 3U);
  EXPECT_TRUE(apart->isMinority());
  EXPECT_EQ(apart->inWords(), "every 7th frame");
  EXPECT_NEAR(apart->range_mm.mean, 0.6, 4.0 * apart->range_mm.error);
}

TEST(FramesApart, TheFirstOfEachCaptureIsFoundByItsPlace) {
  const auto apart = framesApart(noisy(3, [](std::uint64_t, std::size_t k) { return k == 0 ? -0.6 : 0.0; }), 1);
  ASSERT_TRUE(apart);
  EXPECT_TRUE(apart->which.is_in_capture);
  EXPECT_EQ(apart->inWords(), "the 1st frame of each capture");
  EXPECT_NEAR(apart->range_mm.mean, -0.6, 4.0 * apart->range_mm.error);
}

/// A drift within captures puts the last frames apart from the first.
TEST(FramesApart, AStraightDriftIsNone) {
  EXPECT_FALSE(framesApart(noisy(4, [](std::uint64_t, std::size_t k) { return 0.5 * static_cast<double>(k); }), 1));
}

/// Of what wanders from frame to frame first and last ones are farthest from the mean in every capture, but for its drift.
TEST(FramesApart, FramesThatWanderAreNone) {
  int told = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    std::mt19937_64 random{seed};
    std::normal_distribution<double> normal;
    double place = 0.0;
    const auto wander = [&](std::uint64_t, std::size_t) { return place += normal(random); };
    told += framesApart(noisy(seed, wander, 200), seed) ? 1 : 0;
  }
  EXPECT_EQ(told, 0);
}

TEST(FramesApart, AHandfulOfFramesSaysNothing) {
  auto few = noisy(5, [](std::uint64_t sequence, std::size_t) { return sequence % 2 == 0 ? 3.0 : -3.0; });
  few.resize(2);
  EXPECT_FALSE(framesApart(few, 1));
}

/// The mean over eight frames has an eighth of what the first has too much, which was told as the camera's; without it
/// there is nothing.
TEST_F(Searched, AFrameThatIsApartIsLeftOutOfTheMeans) {
  simulate("", [](sim::RangeImage& image, const Moment&, const CameraInfo&, std::uint64_t frame) {
    for (float& range : image.range_m.pixels()) range += frame == 0 ? 0.02F + 0.1F * (range - 1.5F) : 0.0F;
  });
  const CampaignFinding finding = search(job());
  ASSERT_EQ(finding.effects.size(), 1U) << verdictOf(finding);
  EXPECT_THAT(finding.effects.front().found.covariates, ElementsAre("frame"));
  EXPECT_THAT(verdictOf(finding), HasSubstr("frame differs from the others"));
  EXPECT_THAT(finding.notes, Contains(HasSubstr("left out of all means")));
  EXPECT_EQ(finding.model_toml.find("learned"), std::string::npos) << "no model has what one frame has too much";
}

}  // namespace
}  // namespace toftwin::discover
