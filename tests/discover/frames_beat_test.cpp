// SPDX-License-Identifier: Apache-2.0
// A wave that goes over the frames in no whole number of them.
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include <gmock/gmock.h>

#include "calib/discover/campaign/search/frames_apart.h"
#include "calib/discover/campaign/search/frames_beat.h"
#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

struct Beating {
  double amplitude_mm = 0.0, period = 3.3;
  std::size_t captures = 30, frames = 8;
  double memory = 0.0, noise_mm = 0.3;  ///< what a frame errs like the one before; 1: a walk
};
std::vector<MeasuredCapture> beating(std::uint64_t seed, const Beating& how) {
  std::mt19937_64 random{seed};
  std::normal_distribution<double> normal;
  std::vector<MeasuredCapture> captures(how.captures);
  std::uint64_t sequence = 0;
  for (std::size_t c = 0; c < captures.size(); ++c, sequence += c % 7) {
    const double noise_mm = how.noise_mm * static_cast<double>(1 + c % 3);
    double wanders = 0.0;
    for (std::size_t k = 0; k < how.frames; ++k, ++sequence) {
      wanders = how.memory * wanders + noise_mm * normal(random);
      const double wave = std::sin(2.0 * std::numbers::pi * static_cast<double>(sequence) / how.period);
      captures[c].each.push_back({sequence, 1500.0 + how.amplitude_mm * wave + wanders, normal(random)});
    }
  }
  return captures;
}

TEST(FramesBeat, IsFoundWithItsPeriodAndItsSize) {
  for (const Beating& how : {Beating{.amplitude_mm = 0.6}, {.amplitude_mm = 0.6, .period = 2.9},
                             {.amplitude_mm = 0.3, .period = 5.7, .captures = 60, .frames = 32},
                             {.amplitude_mm = 0.3, .period = 2.35, .captures = 12, .frames = 100}}) {
    const auto beat = framesBeat(beating(3, how), 1);
    ASSERT_TRUE(beat && beat->range_mm) << how.period;
    EXPECT_NEAR(beat->period.mean, how.period, 4.0 * beat->period.error);
    EXPECT_LT(beat->period.error, 0.05 * how.period);
    EXPECT_NEAR(beat->range_mm->mean, how.amplitude_mm, 4.0 * beat->range_mm->error + 0.05 * how.amplitude_mm);
    EXPECT_FALSE(beat->gain_percent);
  }
}

/// One in 500 is told wrongly: of 40 three or more once in 10,000.
TEST(FramesBeat, IsNotInNoiseOrInWhatWanders) {
  for (const double memory : {0.0, 0.2, 0.5, 0.9, 1.0}) {
    for (const std::size_t frames : {8U, 16U, 100U}) {
      int told = 0;
      for (std::uint64_t seed = 1; seed <= 40; ++seed)
        told += framesBeat(beating(seed, {.captures = 40, .frames = frames, .memory = memory}), seed) ? 1 : 0;
      EXPECT_LE(told, 2) << memory << ' ' << frames;
    }
  }
}

TEST(FramesBeat, SevenFramesOrFiveCapturesSayNothing) {
  EXPECT_FALSE(framesBeat(beating(1, {.amplitude_mm = 3.0, .captures = 200, .frames = 7}), 1));
  EXPECT_FALSE(framesBeat(beating(1, {.amplitude_mm = 3.0, .captures = 5, .frames = 32}), 1));
  EXPECT_TRUE(framesBeat(beating(1, {.amplitude_mm = 3.0, .captures = 6, .frames = 32}), 1));
}

/// Frames that the source lost between others are no wave.
TEST(FramesBeat, TakesFramesInARowOnly) {
  auto captures = beating(1, {.amplitude_mm = 3.0});
  for (MeasuredCapture& capture : captures) capture.each.erase(capture.each.begin() + 3);
  EXPECT_FALSE(framesBeat(captures, 1));
}

TEST_F(Searched, FramesThatBeatAreTold) {
  std::uint64_t before = 0;  // frames are taken between captures, too
  simulate("", [&before](sim::RangeImage& image, const Moment&, const CameraInfo&, std::uint64_t frame) {
    if (frame == 0) before += 17;
    const double turns = static_cast<double>(before + frame) / 3.3;
    const auto late = static_cast<float>(0.004 * std::sin(2.0 * std::numbers::pi * turns));
    for (float& range : image.range_m.pixels()) range += late;
  });
  const CampaignFinding finding = search(job());
  ASSERT_EQ(finding.effects.size(), 1U) << verdictOf(finding);
  EXPECT_THAT(finding.effects.front().found.covariates, ElementsAre("frame"));
  EXPECT_THAT(verdictOf(finding), HasSubstr("a wave over the frames, one in 3."));
  const auto& period = finding.effects.front().found.numbers.front();
  EXPECT_NEAR(period.value, 3.3, 4.0 * period.error);
  EXPECT_LT(period.error, 0.1);
  ASSERT_TRUE(finding.alike_p);
  EXPECT_LT(*finding.alike_p, 0.002);
}

}  // namespace
}  // namespace toftwin::discover
