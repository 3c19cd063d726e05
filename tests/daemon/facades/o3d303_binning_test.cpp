// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "daemon/facades/frame_views.h"
#include "daemon/facades/o3d303/binning.h"

namespace toftwin::daemon::o3d303 {
namespace {

constexpr auto kInvalid = static_cast<std::uint8_t>(PixelFlag::Invalid);
constexpr auto kSaturated = static_cast<std::uint8_t>(PixelFlag::Saturated);

/// Four by two pixels, which become two by one.
Frame frameOf(const std::vector<float>& range_m, const std::vector<float>& amplitude,
              const std::vector<std::uint8_t>& flags) {
  const auto planeWith = [](PlaneKind kind, ElementType type, Buffer data) {
    return Plane{.kind = kind, .type = type, .width = 4, .height = 2, .channels = 1, .data = std::move(data)};
  };
  Frame frame;
  frame.camera.width = 4;
  frame.camera.height = 2;
  frame.camera.fx = frame.camera.fy = 3.0;
  frame.camera.cx = 1.5;
  frame.camera.cy = 0.5;
  frame.planes = {planeWith(PlaneKind::Range, ElementType::F32, Buffer::adopt(range_m)),
                  planeWith(PlaneKind::Amplitude, ElementType::F32, Buffer::adopt(amplitude)),
                  planeWith(PlaneKind::Flags, ElementType::U8, Buffer::adopt(flags))};
  return frame;
}

const Frame kFrame =
    frameOf({1.0F, 2.0F, 5.0F, 5.0F, 3.0F, NAN, 5.0F, 5.0F}, {1.0F, 3.0F, 8.0F, 8.0F, 4.0F, 0.0F, 8.0F, 8.0F},
            {0, 0, kInvalid, kInvalid, kSaturated, kInvalid, kInvalid, kInvalid});

TEST(O3d303Binning, RangesCountByTheirAmplitudes) {
  const Frame small = binned(kFrame, Binning::ByAmplitude);
  EXPECT_FLOAT_EQ(small.find(PlaneKind::Range)->as<float>()[0], (1.0F * 1 + 2.0F * 3 + 3.0F * 4) / 8);
}

TEST(O3d303Binning, OfTheSimpleOneTheyCountAlike) {
  const Frame small = binned(kFrame, Binning::Simple);
  EXPECT_FLOAT_EQ(small.find(PlaneKind::Range)->as<float>()[0], 2.0F) << "of three; the fourth is none";
}

TEST(O3d303Binning, FourInvalidPixelsAreOne) {
  const Frame small = binned(kFrame, Binning::Simple);
  EXPECT_TRUE(std::isnan(small.find(PlaneKind::Range)->as<float>()[1]));
  EXPECT_EQ(small.find(PlaneKind::Flags)->as<std::uint8_t>()[1], kInvalid);
}

TEST(O3d303Binning, FlagsAreThoseOfTheValidPixels) {
  const Frame small = binned(kFrame, Binning::Simple);
  EXPECT_EQ(small.find(PlaneKind::Flags)->as<std::uint8_t>()[0], kSaturated);
}

TEST(O3d303Binning, APixelLooksWhereTheMiddleOfItsFourDoes) {
  const Frame small = binned(kFrame, Binning::Simple);
  EXPECT_EQ(small.camera.width, 2);
  EXPECT_EQ(small.camera.height, 1);
  const auto big = rayThroughPixel(kFrame.camera, 0.5, 0.5).v, now = rayThroughPixel(small.camera, 0, 0).v;
  EXPECT_NEAR(now.x, big.x, 1e-12);
  EXPECT_NEAR(now.y, big.y, 1e-12);
}

}  // namespace
}  // namespace toftwin::daemon::o3d303
