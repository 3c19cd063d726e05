// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/answer/judged_regions.h"

#include <cmath>

#include <gtest/gtest.h>
#include <toftwin/nan.h>

namespace toftwin::discover {
namespace {

const JudgedRegion* find(const std::vector<JudgedRegion>& regions, const std::string& name) {
  for (const JudgedRegion& region : regions)
    if (region.name == name) return &region;
  return nullptr;
}

TEST(JudgedRegions, HasBeforeAndAfterOfEachPlaceRangeAndAmplitude) {
  std::vector<JudgedPixel> pixels;
  for (int i = 0; i < 9; ++i) {
    const auto x = static_cast<float>(i);
    pixels.push_back({.before_mm = 3.0F, .after_mm = x < 4.5F ? 1.0F : -1.0F, .range_m = 0.5F + 0.25F * x,
                      .log_amplitude = x, .variance_mm2 = 4.0F, .radius = 0.1F * x});
  }
  pixels.push_back({.before_mm = 30.0F, .after_mm = 20.0F, .range_m = 1.0F, .variance_mm2 = 9.0F, .is_edge = true});
  const auto regions = regionsOf(pixels);
  const JudgedRegion* surfaces = find(regions, "surfaces");
  ASSERT_NE(surfaces, nullptr);
  EXPECT_EQ(surfaces->pixels, 9U);
  EXPECT_DOUBLE_EQ(surfaces->bias_before_mm, 3.0);
  EXPECT_NEAR(surfaces->bias_after_mm, 1.0 / 9.0, 1e-12);
  EXPECT_DOUBLE_EQ(surfaces->rms_after_mm, 1.0);
  EXPECT_DOUBLE_EQ(surfaces->noise_mm, 2.0);
  ASSERT_NE(find(regions, "edges"), nullptr);
  EXPECT_DOUBLE_EQ(find(regions, "edges")->rms_after_mm, 20.0);
  EXPECT_EQ(find(regions, "middle of the image")->pixels, 4U);   // 0 to 0.3
  EXPECT_EQ(find(regions, "around it")->pixels, 3U);             // 0.4 to 0.6
  EXPECT_EQ(find(regions, "corners of the image")->pixels, 2U);  // 0.7, 0.8
  EXPECT_EQ(find(regions, "range 1–1.5 m")->pixels, 2U);         // 1 and 1.25; the edge is none
  EXPECT_EQ(find(regions, "range over 4.5 m"), nullptr);
  EXPECT_EQ(find(regions, "darkest third")->pixels + find(regions, "middle third")->pixels +
                find(regions, "brightest third")->pixels,
            9U);
}

TEST(JudgedRegions, ACameraWithoutAmplitudesHasNoThirds) {
  const auto regions = regionsOf({{.before_mm = 1.0F, .after_mm = 1.0F, .range_m = 1.0F, .log_amplitude = kNaN}});
  EXPECT_NE(find(regions, "surfaces"), nullptr);
  EXPECT_EQ(find(regions, "darkest third"), nullptr);
  EXPECT_EQ(find(regions, "edges"), nullptr);
}

}  // namespace
}  // namespace toftwin::discover
