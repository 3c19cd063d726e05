// SPDX-License-Identifier: Apache-2.0
// What is wrong with poses and with decoded ranges, and light of what is too bright.
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <gmock/gmock.h>
#include <toftwin/nan.h>

#include "calib/discover/campaign/rows/pose_errors.h"
#include "calib/discover/campaign/rows/smeared_ranges.h"
#include "calib/discover/campaign/rows/spilled_light.h"
#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST_F(Searched, ARigThatGoesTooFarIsNotTheCamera) {
  rig_mm_per_m_ = 6.0;
  simulate("");
  const CampaignFinding finding = search(job());
  ASSERT_EQ(finding.effects.size(), 1U) << verdictOf(finding);
  const Effect& effect = finding.effects.front().found;
  EXPECT_THAT(effect.covariates, ElementsAre("pose"));
  EXPECT_EQ(effect.name, "the rig goes farther than it says");
  const auto way = std::ranges::find(effect.numbers, "pose:way", &Estimate::name);
  ASSERT_NE(way, effect.numbers.end());
  EXPECT_NEAR(way->value, 6.0, 4.0 * way->error);
  EXPECT_LT(way->error, 1.5);
  EXPECT_THAT(verdictOf(finding), HasSubstr("The model of the camera lacks nothing that these captures show"));
  EXPECT_EQ(finding.model_toml.find("learned"), std::string::npos) << "the camera is as it was";
}

/// A quarter turn about y: what lies along the camera's x is along the world's −z.
TEST(PoseErrors, AreOfTheWorldsAxesAndOfTheWay) {
  Eigen::MatrixXf moves(1, 5);
  moves << 1.0F, 10.0F, 100.0F, 7.0F, 8.0F;
  Transform<World, Camera> pose = rotation<World, Camera>({0.0, 1.0, 0.0}, 0.5 * std::numbers::pi);
  pose.translation_m = {0.5, 0.0, 2.0};
  const auto columns = poseColumns(moves, pose);
  EXPECT_NEAR(columns.at("pose:world_z")[0], -1.0F, 1e-5F);
  EXPECT_NEAR(columns.at("pose:world_x")[0], 100.0F, 1e-4F);
  EXPECT_NEAR(columns.at("pose:world_y")[0], 10.0F, 1e-5F);
  EXPECT_NEAR(columns.at("pose:way")[0], 0.5F * 100.0F - 2.0F, 1e-4F);
  EXPECT_EQ(columns.at("pose:about_y")[0], 8.0F);
}

/// Ranges 1, 2, 4 along each row, the row below twice as far, the next one four times.
TEST(SmearedRanges, AreSharesOfNeighbours) {
  Reading reading{Image<float>(3, 3), Image<float>(3, 3)};
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 3; ++x) reading.range_m(x, y) = static_cast<float>((1 << x) * (1 << y));
  const auto all = smearedCarriers(reading);
  EXPECT_NEAR(all.at("smeared:across").range_m(1, 1), 0.01F * 0.5F * (2.0F - 8.0F), 1e-6F);
  EXPECT_NEAR(all.at("smeared:along").range_m(1, 1), 0.01F * 0.5F * (2.0F - 8.0F), 1e-6F);
  EXPECT_NEAR(all.at("smeared:around").range_m(1, 1), 0.01F * (45.0F / 8.0F - 4.0F), 1e-6F);
  EXPECT_EQ(all.at("smeared:around").log_amplitude(1, 1), 0.0F) << "the light is as it was";
}

/// A firmware that takes a quarter of each dim pixel's left neighbour: a shift of a quarter of a pixel where it is dim,
/// and none where it is not. (As two filters, one for all pixels and one that takes it off bright ones, it was worse
/// than none.)
TEST_F(Searched, RangesThatComeFromNeighboursAreTold) {
  simulate("", [](sim::RangeImage& image, const Moment&, const CameraInfo&, std::uint64_t) {
    const Image<float> as_read = image.range_m;
    for (int y = 0; y < as_read.height(); ++y)
      for (int x = 1; x < as_read.width(); ++x)
        if (image.amplitude(x, y) < 20000.0F) image.range_m(x, y) += 0.25F * (as_read(x - 1, y) - as_read(x, y));
  });
  const CampaignFinding finding = search(job());
  ASSERT_FALSE(finding.effects.empty()) << verdictOf(finding);
  EXPECT_THAT(verdictOf(finding), HasSubstr("ranges from neighbours"));
  const auto model = sim::SensorModel::parse(finding.model_toml, "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_THAT(model->effectNames(), testing::Contains("learned"));
  ASSERT_TRUE(finding.judgement);
  EXPECT_GT(finding.judgement->removed, 0.7) << verdictOf(finding);
}

/// One pixel in four is at the brightest, two are far below an eighth of it; half of a turn apart from what is dark.
TEST(SpilledLight, IsOfWhatIsBeyondABrightness) {
  Reading reading{Image<float>(2, 2, 0.5F), Image<float>(2, 2, std::log(10.0F))};
  reading.log_amplitude(0, 0) = std::log(1000.0F), reading.range_m(0, 0) = 0.0F;
  const auto all = spilledCarriers(reading, phasorOf(reading, 2.0), 2.0, 1000.0);
  // δz = 1 % · (1000 − 500)/4 at phase 0; of a pixel of 10 electrons at a quarter turn, z = −10i: δz/z = 0.125 i.
  const Reading& half = all.at("spilled:1/2");
  EXPECT_NEAR(half.log_amplitude(1, 1), 0.0F, 1e-6F);
  EXPECT_NEAR(half.range_m(1, 1), -2.0 / (2.0 * std::numbers::pi) * 0.125, 1e-6);
  EXPECT_NEAR(all.at("spilled:1/8").range_m(1, 1), -2.0 / (2.0 * std::numbers::pi) * 0.125 * 7.0 / 4.0, 1e-6);
  const Reading dark{Image<float>(2, 2, 0.5F), Image<float>(2, 2, std::log(10.0F))};
  const auto none = spilledCarriers(dark, phasorOf(dark, 2.0), 2.0, 1000.0);
  EXPECT_EQ(none.at("spilled:1/8").range_m(1, 1), 0.0F);
}

/// A pixel that nobody can read, as it is too bright, spills all the same: its light is in proportion to the others'.
TEST(SpilledLight, IsOfPixelsThatAreTooBrightToBeRead) {
  Reading reading{Image<float>(2, 2, 0.5F), Image<float>(2, 2, std::log(10.0F))};
  Image<std::complex<float>> light(2, 2, {0.0F, -0.1F});
  light(0, 0) = {10.0F, 0.0F};
  reading.range_m(0, 0) = reading.log_amplitude(0, 0) = kNaN;
  const Phasors sources = withUnread(phasorOf(reading, 2.0), light);
  EXPECT_NEAR(std::abs(sources(0, 0) - std::complex<float>{1000.0F, 0.0F}), 0.0F, 1e-2F);
  const auto all = spilledCarriers(reading, sources, 2.0, 1000.0);
  EXPECT_NEAR(all.at("spilled:1/2").range_m(1, 1), -2.0 / (2.0 * std::numbers::pi) * 0.125, 1e-6);
}

}  // namespace
}  // namespace toftwin::discover
