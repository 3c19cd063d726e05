// SPDX-License-Identifier: Apache-2.0
// Frames that differ from the others that were taken with them.
#include <cmath>
#include <functional>
#include <ostream>
#include <random>

#include <gmock/gmock.h>

#include "calib/discover/campaign/answer/campaign_json.h"
#include "calib/discover/campaign/search/frames_apart.h"
#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

using Late = std::function<double(std::uint64_t sequence, std::size_t place)>;
struct Taken {
  std::size_t captures = 30, frames = 8;
  double noise_mm = 0.1;  ///< once to five times that, from capture to capture
  /// Of each capture's numbers the first; none: the source counts on, with gaps between captures.
  std::function<std::uint64_t(std::size_t)> from{};
  bool has_amplitude = true;
};
std::vector<MeasuredCapture> noisy(std::uint64_t seed, const Late& late_mm, const Taken& taken = {}) {
  std::mt19937_64 random{seed};
  std::normal_distribution<double> normal;
  std::vector<MeasuredCapture> captures(taken.captures);
  std::uint64_t sequence = 0;
  for (std::size_t c = 0; c < captures.size(); ++c) {
    const double noise_mm = taken.noise_mm * static_cast<double>(1 + c % 5);
    sequence = taken.from ? taken.from(c) : sequence + c % 3;
    for (std::size_t k = 0; k < taken.frames; ++k, ++sequence) {
      const double range_mm = 1500.0 + late_mm(sequence, k) + noise_mm * normal(random), gain = normal(random);
      captures[c].each.push_back({sequence, range_mm, taken.has_amplitude ? gain : 0.0});
    }
  }
  return captures;
}

double nothing(std::uint64_t, std::size_t) { return 0.0; }
/// What the simulated runs of these tests do: a multiple of 2, 4, 5 and 8.
std::uint64_t thousands(std::size_t c) { return 1000 * c; }

/// One in 500 seeds is told wrongly: four or more of 100 are so once in 20,000.
TEST(FramesApart, FramesThatAreAlikeAreNotApart) {
  int told = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) told += framesApart(noisy(seed, nothing), seed) ? 1 : 0;
  EXPECT_LE(told, 3);
}

/// Of few frames a line and a mean leave residuals that are not alike in any order, which many captures show: of four,
/// seven of eight seeds were told.
TEST(FramesApart, NorAreManyCapturesOfFewFrames) {
  for (const std::size_t frames : {4U, 5U, 6U, 8U, 16U}) {
    int told = 0;
    for (std::uint64_t seed = 1; seed <= 12; ++seed)
      told += framesApart(noisy(seed, nothing, {.captures = 200, .frames = frames}), seed) ? 1 : 0;
    EXPECT_LE(told, 1) << frames << " frames";
  }
}

TEST(FramesApart, FiveFramesSayNothing) {
  const auto first = [](std::uint64_t, std::size_t k) { return k == 0 ? 3.0 : 0.0; };
  EXPECT_FALSE(framesApart(noisy(1, first, {.captures = 200, .frames = 5}), 1));
  EXPECT_TRUE(framesApart(noisy(1, first, {.captures = 200, .frames = 6}), 1));
}

TEST(FramesApart, EverySecondIsNoMinority) {
  const auto apart = framesApart(
      noisy(1, [](std::uint64_t sequence, std::size_t) { return sequence % 2 == 0 ? 0.3 : -0.3; }), 1);
  ASSERT_TRUE(apart && apart->range_mm);
  EXPECT_EQ(apart->which.period, 2U);
  EXPECT_FALSE(apart->isMinority());
  EXPECT_EQ(apart->inWords(), "every 2nd frame");
  EXPECT_NEAR(std::abs(apart->range_mm->mean), 0.6, 4.0 * apart->range_mm->error);
  EXPECT_LT(apart->range_mm->error, 0.06);
}

TEST(FramesApart, OneInSevenIsFoundByTheSourcesNumbers) {
  const auto apart =
      framesApart(noisy(2, [](std::uint64_t sequence, std::size_t) { return sequence % 7 == 3 ? 0.6 : 0.0; }), 1);
  ASSERT_TRUE(apart && apart->range_mm);
  EXPECT_EQ(apart->which.period, 7U);
  EXPECT_EQ(apart->which.rest, 3U);
  EXPECT_TRUE(apart->isMinority());
  EXPECT_EQ(apart->inWords(), "every 7th frame");
  EXPECT_NEAR(apart->range_mm->mean, 0.6, 4.0 * apart->range_mm->error);
  EXPECT_LT(apart->range_mm->error, 0.09);
}

/// What is now farther, now nearer, as the scene has it, has no sum.
TEST(FramesApart, OneInSevenIsFoundByItsSizeToo) {
  std::mt19937_64 random{7};
  std::normal_distribution<double> normal;
  const auto late = [&](std::uint64_t sequence, std::size_t) { return sequence % 7 == 3 ? 2.0 * normal(random) : 0.0; };
  const auto apart = framesApart(noisy(2, late, {.captures = 60}), 1);
  ASSERT_TRUE(apart);
  EXPECT_EQ(apart->inWords(), "every 7th frame");
}

TEST(FramesApart, TheFirstOfEachCaptureIsFoundByItsPlace) {
  const auto apart = framesApart(noisy(3, [](std::uint64_t, std::size_t k) { return k == 0 ? -0.6 : 0.0; }), 1);
  ASSERT_TRUE(apart && apart->range_mm);
  EXPECT_TRUE(apart->isMinority());
  EXPECT_EQ(apart->inWords(), "the 1st frame of each capture");
  EXPECT_NEAR(apart->range_mm->mean, -0.6, 4.0 * apart->range_mm->error);
  EXPECT_LT(apart->range_mm->error, 0.09);
}

/// Where captures begin with multiples of 8 and have eight frames, every 8th frame is one place in each of them, and of
/// 16 frames every 4th is, too.
TEST(FramesApart, APlaceIsToldAsOneWhateverTheSourceCounts) {
  const auto namesOf = [](std::size_t frames, const Late& late) {
    const auto apart = framesApart(noisy(3, late, {.frames = frames, .from = thousands}), 1);
    return apart ? apart->inWords() : "nothing";
  };
  EXPECT_EQ(namesOf(8, [](auto, std::size_t k) { return k == 0 ? 0.6 : 0.0; }), "the 1st frame of each capture");
  EXPECT_EQ(namesOf(8, [](auto, std::size_t k) { return k == 5 ? 0.6 : 0.0; }), "the 6th frame of each capture");
  EXPECT_EQ(namesOf(16, [](auto, std::size_t k) { return k % 4 == 1 ? 0.6 : 0.0; }),
            "every 4th frame of each capture, from the 2nd on");
}

/// A drift within captures puts the last frames apart from the first.
TEST(FramesApart, AStraightDriftIsNone) {
  EXPECT_FALSE(framesApart(noisy(4, [](std::uint64_t, std::size_t k) { return 0.5 * static_cast<double>(k); }), 1));
}

/// The first is farther than the drift has it, though nearer than the mean of the others.
TEST(FramesApart, ADriftIsNoPartOfTheDifference) {
  const auto late = [](std::uint64_t, std::size_t k) { return 0.5 * static_cast<double>(k) + (k == 0 ? 1.0 : 0.0); };
  const auto apart = framesApart(noisy(4, late), 1);
  ASSERT_TRUE(apart && apart->range_mm);
  EXPECT_EQ(apart->inWords(), "the 1st frame of each capture");
  EXPECT_NEAR(apart->range_mm->mean, 1.0, 4.0 * apart->range_mm->error);
  EXPECT_LT(apart->range_mm->error, 0.1);
}

TEST(FramesApart, WhatWasNotMeasuredIsNotTold) {
  const auto late = [](std::uint64_t, std::size_t k) { return k == 0 ? 1.0 : 0.0; };
  const auto apart = framesApart(noisy(4, late, {.has_amplitude = false}), 1);
  ASSERT_TRUE(apart && apart->range_mm);
  EXPECT_FALSE(apart->gain_percent);
  const std::vector<Estimate> numbers = effectOf(*apart).found.numbers;
  ASSERT_EQ(numbers.size(), 1U);
  EXPECT_EQ(numbers.front().name, "range_mm");
}

struct Wandering {
  std::string name;
  std::size_t captures, frames;
  double keeps;     ///< of where it was a frame before: 1: a walk
  double noise_mm;  ///< beside it, as Taken::noise_mm
};
void PrintTo(const Wandering& w, std::ostream* out) { *out << w.name << " of " << w.frames << " frames"; }

class FramesThatWander : public testing::TestWithParam<Wandering> {};

/// What wanders from frame to frame is farthest from its mean where a capture begins and ends, and each frame goes with
/// the one before it. Numbers count on with gaps, without, or begin anew.
TEST_P(FramesThatWander, AreNone) {
  const Wandering& by = GetParam();
  int told = 0;
  const std::function<std::uint64_t(std::size_t)> countOn = [&](std::size_t c) { return c * by.frames; };
  for (const auto& from : {std::function<std::uint64_t(std::size_t)>{}, countOn, {thousands}}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      std::mt19937_64 random{seed};
      std::normal_distribution<double> normal;
      double place = 0.0;
      const auto wander = [&](std::uint64_t, std::size_t) { return place = by.keeps * place + normal(random); };
      const Taken taken{
          .captures = by.captures, .frames = by.frames, .noise_mm = by.noise_mm, .from = from};
      told += framesApart(noisy(seed, wander, taken), seed) ? 1 : 0;
    }
  }
  EXPECT_EQ(told, 0);
}

INSTANTIATE_TEST_SUITE_P(FramesApart, FramesThatWander,
                         testing::Values(Wandering{"a walk", 200, 6, 1.0, 0.1}, Wandering{"a walk", 200, 8, 1.0, 0.1},
                                         Wandering{"a walk", 60, 16, 1.0, 0.0}, Wandering{"a walk", 200, 32, 1.0, 0.0},
                                         Wandering{"a walk and noise", 12, 100, 1.0, 1.0},
                                         Wandering{"AR(0.9)", 60, 6, 0.9, 0.0}, Wandering{"AR(0.9)", 60, 8, 0.9, 0.0},
                                         Wandering{"AR(0.9)", 60, 16, 0.9, 0.1}, Wandering{"AR(0.9)", 60, 32, 0.9, 0.0},
                                         Wandering{"AR(0.9)", 60, 100, 0.9, 0.0}));

TEST(FramesApart, AHandfulOfCapturesSaysNothing) {
  const auto late = [](std::uint64_t sequence, std::size_t) { return sequence % 2 == 0 ? 3.0 : -3.0; };
  EXPECT_FALSE(framesApart(noisy(5, late, {.captures = 5, .frames = 16}), 1));
  EXPECT_TRUE(framesApart(noisy(5, late, {.captures = 6, .frames = 16}), 1));
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
  EXPECT_THAT(verdictOf(finding), HasSubstr("the 1st frame of each capture differs from the others"));
  EXPECT_THAT(finding.notes, Contains(HasSubstr("left out of all means")));
  ASSERT_TRUE(finding.alike_p);
  EXPECT_LT(*finding.alike_p, 0.002);
  EXPECT_GT(finding.finding.first_p, 0.01) << "of the other frames";
  const compare::Json json = jsonOf(job(), finding);
  EXPECT_EQ(json.find("p_no_steps"), nullptr);
  ASSERT_NE(json.find("p_frames_alike"), nullptr);
  EXPECT_EQ(json.find("p_frames_alike")->number(), *finding.alike_p);
  EXPECT_EQ(finding.model_toml.find("learned"), std::string::npos) << "no model has what one frame has too much";
}

/// Of two frames without the first one is left, which says nothing of its noise: such captures keep both, and it is
/// said.
TEST_F(Searched, WhatWouldBeLeftWithoutRepeatsIsTold) {
  plan_ = withReplaced(smallPlan(), {{"name = \"ambient\"\n", "name = \"ambient\"\nframes = 2\n"},
                                     {"name = \"judge\"\n", "name = \"judge\"\nframes = 2\n"}});
  simulate("", [](sim::RangeImage& image, const Moment&, const CameraInfo&, std::uint64_t frame) {
    for (float& range : image.range_m.pixels()) range += frame == 0 ? 0.02F : 0.0F;
  });
  const CampaignFinding finding = search(job());
  EXPECT_THAT(verdictOf(finding), HasSubstr("the 1st frame of each capture differs from the others"));
  EXPECT_THAT(finding.notes, Contains(HasSubstr("3 open captures keep all frames")));
  EXPECT_THAT(finding.notes, Contains(HasSubstr("3 locked captures keep all frames")));
}

}  // namespace
}  // namespace toftwin::discover
