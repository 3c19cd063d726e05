// SPDX-License-Identifier: Apache-2.0
// Which part of its image a camera sends, by what it says of its sides.
#include "drivers/aravis/region.h"

#include <gtest/gtest.h>

namespace toftwin::drivers::aravis {
namespace {

/// 320 x 240 from (100, 50) on, of a camera that says these sides.
Region regionOf(int sensor_width, int sensor_height, int width_max, int height_max) {
  return {.x = 100,
          .y = 50,
          .width = 320,
          .height = 240,
          .whole_width = wholeSide(sensor_width, width_max, 100, 320),
          .whole_height = wholeSide(sensor_height, height_max, 50, 240)};
}
Result<Lens> lensOf(int width, int height, const Region& region) {
  return lensOfRegion(LensKeys{.width = width, .height = height, .fx = 500.0, .cx = 300.0, .cy = 200.0},
                      region);
}
void expectCut(int width, int height, const Region& region) {
  const auto lens = lensOf(width, height, region);
  ASSERT_TRUE(lens.ok()) << lens.error().message;
  EXPECT_EQ(lens->camera.fx, 500.0);
  EXPECT_EQ(lens->camera.cx, 200.0);
  EXPECT_EQ(lens->camera.cy, 150.0);
}
void expectRefused(int width, int height, const Region& region) {
  const auto lens = lensOf(width, height, region);
  ASSERT_FALSE(lens.ok()) << width << " x " << height;
  EXPECT_EQ(lens.error().code, Error::Code::Incompatible);
}

TEST(AravisRegion, TheSensorSaysWhatTheLargestRegionIsCountedFrom) {
  for (const Region& region :
       {regionOf(640, 480, 640, 480), regionOf(640, 480, 540, 430), regionOf(640, 480, 0, 0)}) {
    expectCut(640, 480, region);
    expectRefused(540, 430, region);
    expectRefused(740, 530, region);
  }
}

TEST(AravisRegion, WithoutASensorsSizeALensOfEitherReadingIsTaken) {
  const Region region = regionOf(0, 0, 640, 480);
  expectCut(640, 480, region);
  expectCut(740, 530, region);
  expectRefused(700, 500, region);
}

TEST(AravisRegion, ASensorThatIsLargerThanAnyRegionIsNotTheWholeImage) {
  const Region bordered = regionOf(656, 496, 640, 480);
  expectCut(640, 480, bordered);
  expectRefused(656, 496, bordered);
  expectRefused(1280, 960, regionOf(1280, 960, 640, 480));
  // Without a region: binned without a word, so the lens is scaled.
  const Region binned{.width = 640,
                      .height = 480,
                      .whole_width = wholeSide(1280, 640, 0, 640),
                      .whole_height = wholeSide(960, 480, 0, 480)};
  const auto lens = lensOf(1280, 960, binned);
  ASSERT_TRUE(lens.ok()) << lens.error().message;
  EXPECT_EQ(lens->camera.fx, 250.0);
}

TEST(AravisRegion, ACropOfAFieldOfViewMagnifiesNothing) {
  const auto lens = lensOfRegion(LensKeys{.width = 640, .height = 480, .field_of_view = 90_deg},
                                 regionOf(640, 480, 640, 480));
  ASSERT_TRUE(lens.ok()) << lens.error().message;
  EXPECT_NEAR(lens->camera.fx, 320.0, 1e-9);
  EXPECT_EQ(lens->camera.cx, 319.5 - 100.0);
  EXPECT_EQ(lens->camera.cy, 239.5 - 50.0);
}

}  // namespace
}  // namespace toftwin::drivers::aravis
