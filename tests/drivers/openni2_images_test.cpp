// SPDX-License-Identifier: Apache-2.0
#include "drivers/openni2/images.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "drivers/openni2/pairing.h"

namespace toftwin::drivers::openni2 {
namespace {

std::vector<std::byte> bytesOf(const std::vector<std::uint16_t>& words) {
  std::vector<std::byte> bytes(2 * words.size());
  std::memcpy(bytes.data(), words.data(), bytes.size());
  return bytes;
}

TEST(OpenNI2Images, DepthIsInItsUnitAndZeroIsNoValue) {
  const auto bytes = bytesOf({1500, 0, 65535, 7, 10, 20, 30, 40});  // two of each row are padding
  const Image<float> depth_per_range{2, 2, 0.5F};
  for (const auto& [format, unit_m] :
       {std::pair{ONI_PIXEL_FORMAT_DEPTH_1_MM, 1e-3F}, {ONI_PIXEL_FORMAT_DEPTH_100_UM, 1e-4F}}) {
    const auto images = depthImages({bytes, 2, 2, 8, format}, depth_per_range);
    ASSERT_TRUE(images.ok()) << images.error().message;
    EXPECT_EQ(images->depth_m(0, 0), 1500.0F * unit_m);
    EXPECT_EQ(images->range_m(0, 0), 1500.0F * unit_m / 0.5F);
    EXPECT_TRUE(std::isnan(images->depth_m(1, 0)) && std::isnan(images->range_m(1, 0)));
    EXPECT_EQ(images->flags(1, 0), static_cast<std::uint8_t>(PixelFlag::Invalid));
    EXPECT_EQ(images->depth_m(1, 1), 20.0F * unit_m) << "the stride leads to the second row";
    EXPECT_EQ(images->flags(1, 1), 0);
  }
}

// Colour bars of BT.601: white 235 128 128, black 16 128 128, red 81 90 240, green 145 54 34 and
// blue 41 240 110, each rounded to a whole level, which is 1.6 at most in blue (255/224 · 1.772 ·
// 0.5 plus 255/219 · 0.5).
TEST(OpenNI2Images, VideoLevelsBecomeRedGreenAndBlue) {
  struct Bar {
    int y, u, v, red, green, blue;
  };
  for (const Bar& bar : {Bar{235, 128, 128, 255, 255, 255},
                         {16, 128, 128, 0, 0, 0},
                         {81, 90, 240, 255, 0, 0},
                         {145, 54, 34, 0, 255, 0},
                         {41, 240, 110, 0, 0, 255}}) {
    const auto y = static_cast<std::byte>(bar.y), u = static_cast<std::byte>(bar.u),
               v = static_cast<std::byte>(bar.v);
    for (const auto& [format, bytes] : {std::pair{ONI_PIXEL_FORMAT_YUV422, std::vector{u, y, v, y}},
                                        {ONI_PIXEL_FORMAT_YUYV, std::vector{y, u, y, v}}}) {
      const auto plane = colorPlane({bytes, 2, 1, 4, format}, 2, 1);
      ASSERT_TRUE(plane.ok()) << plane.error().message;
      const auto rgb = plane->as<std::uint8_t>();
      for (std::size_t x = 0; x < 2; ++x) {
        EXPECT_NEAR(rgb[x], bar.red, 2);
        EXPECT_NEAR(rgb[2 + x], bar.green, 2);
        EXPECT_NEAR(rgb[4 + x], bar.blue, 2);
      }
    }
  }
}

TEST(OpenNI2Images, RedGreenAndBlueAreThreePlanes) {
  const std::vector bytes{std::byte{1}, std::byte{2}, std::byte{3},
                          std::byte{4}, std::byte{5}, std::byte{6}};
  const auto plane = colorPlane({bytes, 2, 1, 6, ONI_PIXEL_FORMAT_RGB888}, 2, 1);
  ASSERT_TRUE(plane.ok()) << plane.error().message;
  const auto rgb = plane->as<std::uint8_t>();
  EXPECT_EQ((std::vector<int>{rgb.begin(), rgb.end()}), (std::vector{1, 4, 2, 5, 3, 6}));
}

// Whatever is said of the bytes, only they are read: each image ends where its allocation ends, so
// that AddressSanitizer sees a step beyond it.
TEST(OpenNI2Images, NoDescriptionLeadsOutsideOfTheBytes) {
  std::mt19937 random{20261121};
  RecordProperty("seed", 20261121);
  const auto pick = [&](int low, int high) {
    return std::uniform_int_distribution{low, high}(random);
  };
  constexpr int kFormats[] = {100, 101, 102, 103, 200, 201, 202, 203, 204, 205, 0, -1};
  int good = 0;
  for (int i = 0; i < 20'000; ++i) {
    const int width = pick(1, 9), height = pick(1, 6);
    const std::vector<std::byte> bytes(static_cast<std::size_t>(pick(0, 200)), std::byte{0x5A});
    const int format = kFormats[pick(0, 11)];
    const bool is_wild = pick(0, 9) == 0;
    const RawImage raw{bytes, is_wild ? pick(-5, 1 << 30) : width, height,
                       is_wild ? pick(-(1 << 30), 1 << 30) : pick(0, 40), format};
    good += depthImages(raw, Image<float>{width, height, 1.0F}).ok() ? 1 : 0;
    good += infraredImage(raw, width, height).ok() ? 1 : 0;
    good += colorPlane(raw, width, height).ok() ? 1 : 0;
  }
  EXPECT_GT(good, 1000) << "the test reaches the conversions";
}

using Pairs = Pairing<int>;

TEST(OpenNI2Pairing, EachDepthImageGetsTheNearestOfTheOthers) {
  Pairs pairs{{.companions = 1, .interval_us = 100, .most_apart_us = 100}};
  pairs.addDepth(1000, 1);
  EXPECT_FALSE(pairs.take().has_value()) << "its company may be under way";
  pairs.addCompanion(0, 940, 10);
  EXPECT_FALSE(pairs.take().has_value()) << "a nearer one may be under way";
  pairs.addCompanion(0, 1030, 11);
  const auto set = pairs.take();
  ASSERT_TRUE(set.has_value());
  EXPECT_EQ(set->depth, 1);
  EXPECT_EQ(*set->companions.at(0), 11);
  EXPECT_EQ(pairs.takeLost(), 0u);
}

TEST(OpenNI2Pairing, ADepthImageWithoutCompanyIsLostAndNotGivenWithAnOldImage) {
  Pairs pairs{{.companions = 1, .interval_us = 100, .most_apart_us = 100}};
  pairs.addCompanion(0, 1000, 10);
  for (int i = 0; i < 6; ++i) pairs.addDepth(1200 + 100 * i, i);
  EXPECT_FALSE(pairs.take().has_value());
  EXPECT_EQ(pairs.takeLost(), 4u) << "two wait for what may still come";
}

TEST(OpenNI2Pairing, AClockThatIsSetBackDoesNotStopIt) {
  Pairs pairs{{.companions = 1, .interval_us = 100, .most_apart_us = 100}};
  pairs.addDepth(5000, 1);
  pairs.addDepth(100, 2);
  pairs.addCompanion(0, 5010, 20);
  pairs.addCompanion(0, 110, 21);
  const auto set = pairs.take();
  ASSERT_TRUE(set.has_value());
  EXPECT_EQ(set->depth, 2);
  EXPECT_EQ(*set->companions.at(0), 21);
  EXPECT_EQ(pairs.takeLost(), 1u);
}

}  // namespace
}  // namespace toftwin::drivers::openni2
