// SPDX-License-Identifier: Apache-2.0
// Every kind of pixels from an emulated camera through the real library, alone and several in one frame.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>

#include "aravis_testing.h"

namespace toftwin::drivers::aravis {
namespace {

using Emulated = toftwin::test::EmulatedGige;

class AravisFormats : public test::Aravis {
 protected:
  /// A and B are codes with a scale and an offset of their own.
  void setAside() {
    for (std::uint32_t axis = 0; axis < 2; ++axis) {
      camera_.setFloatReg(Emulated::kScale + 8 * axis, Emulated::kScaleAside_mm);
      camera_.setFloatReg(Emulated::kOffset + 8 * axis, Emulated::kOffsetAside_mm);
    }
  }
  /// Which frame it is, by its first pixel with a value: (1, 0).
  static std::uint64_t countIn(const Frame& frame) {
    const double depth_mm = 1e3 * static_cast<double>(frame.find(PlaneKind::Depth)->as<float>()[1]);
    const auto code = std::lround((depth_mm - Emulated::kOffset_mm) / Emulated::kScale_mm);
    return static_cast<std::uint64_t>(code - Emulated::rangeCode(0, 1, 0));
  }
  static bool hasValue(const std::array<std::uint16_t, 3>& codes) {
    return std::ranges::none_of(codes, [](std::uint16_t code) { return code == 0; });
  }
  /// Of its points with confidence each is what the codes say; there is none where one of the three has no
  /// value.
  static void expectPoints(const Frame& frame, bool has_confidence) {
    const std::uint64_t n = countIn(frame);
    const auto range_m = frame.find(PlaneKind::Range)->as<float>();
    const auto depth_m = frame.find(PlaneKind::Depth)->as<float>();
    const auto flags = frame.find(PlaneKind::Flags)->as<std::uint8_t>();
    std::size_t i = 0;
    for (int y = 0; y < Emulated::kHeight; ++y) {
      for (int x = 0; x < Emulated::kWidth; ++x, ++i) {
        const auto codes = Emulated::pointCodes(n, x, y);
        const bool is_confident = !has_confidence || Emulated::confidence(x, y) != 0;
        ASSERT_EQ(flags[i], (hasValue(codes) && is_confident ? 0 : 1) | (is_confident ? 0 : 8))
            << x << " " << y;
        if (flags[i] != 0) {
          ASSERT_TRUE(std::isnan(range_m[i]) && std::isnan(depth_m[i])) << x << " " << y;
          continue;
        }
        const double a_mm = Emulated::kScaleAside_mm * codes[0] + Emulated::kOffsetAside_mm,
                     b_mm = Emulated::kScaleAside_mm * codes[1] + Emulated::kOffsetAside_mm,
                     c_mm = Emulated::kScale_mm * codes[2] + Emulated::kOffset_mm;
        ASSERT_NEAR(depth_m[i], 1e-3 * c_mm, 1e-7);  // half a float's step at 1.5 m is 6e-8
        ASSERT_NEAR(range_m[i], 1e-3 * std::hypot(a_mm, b_mm, c_mm), 1e-7);
      }
    }
  }
};

// ---- points ------------------------------------------------------------------------------------

TEST_F(AravisFormats, PointsOf16BitsAreWhatTheirCodesSayOrInvalid) {
  camera_.setFloatReg(Emulated::kFocal, 0.0);
  setAside();
  for (const char* format : {"Coord3D_ABC16", "Coord3D_ABC16_Planar"}) {
    const auto source = started(fmt::format("components = ['Range']\npixel_format = '{}'", format));
    ASSERT_NE(source, nullptr) << format;
    EXPECT_EQ(source->info().planes, (std::vector{PlaneKind::Range, PlaneKind::Depth, PlaneKind::Flags}));
    // A code's rounding is 0.0024 pixels (rms) at 1.2 m; of a thousand points the lens is known to a
    // thirtieth of it.
    EXPECT_NEAR(source->info().camera.fx, Emulated::kFocal_px, 2e-3) << format;
    EXPECT_NEAR(source->info().camera.cx, Emulated::kU_px, 2e-3) << format;
    for (int i = 0; i < 3; ++i) {
      const auto frame = nextFrame(*source);
      ASSERT_TRUE(frame.ok()) << frame.error().message;
      expectPoints(*frame, false);
    }
  }
}

TEST_F(AravisFormats, AnInvalidCodeOfThePointsIsThatOfTheirOwnAxis) {
  setAside();
  // What no pixel has; of C one that the point (1, 0) has in its first frames.
  camera_.setFloatReg(Emulated::kInvalid, 65'535.0);
  camera_.setFloatReg(Emulated::kInvalid + 8, 65'535.0);
  const std::uint16_t code = Emulated::rangeCode(0, 20, 20);
  camera_.setFloatReg(Emulated::kInvalid + 16, code);
  const auto source = started("components = ['Range']\npixel_format = 'Coord3D_ABC16'");
  ASSERT_NE(source, nullptr);
  const auto frame = nextFrame(*source);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  const std::uint64_t n = countIn(*frame);
  const auto depth_m = frame->find(PlaneKind::Depth)->as<float>();
  int without = 0;
  for (int y = 0; y < Emulated::kHeight; ++y) {
    for (int x = 0; x < Emulated::kWidth; ++x) {
      const auto codes = Emulated::pointCodes(n, x, y);
      const bool is_without = codes[2] == code;
      without += is_without ? 1 : 0;
      // 0 is a code as any other now: -2 m aside, or 0.1 m away.
      ASSERT_EQ(std::isnan(depth_m[static_cast<std::size_t>(y * Emulated::kWidth + x)]), is_without)
          << x << " " << y;
    }
  }
  EXPECT_GT(without, 0);
}

TEST_F(AravisFormats, PointsComeInOneFrameWithIntensityAndConfidence) {
  setAside();
  const auto source = started("pixel_format = 'Coord3D_ABC16'");
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->info().planes,
            (std::vector{PlaneKind::Range, PlaneKind::Depth, PlaneKind::Amplitude, PlaneKind::Flags}));
  const auto frame = nextFrame(*source);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  expectPoints(*frame, true);
  const auto amplitude = frame->find(PlaneKind::Amplitude)->as<float>();
  for (std::size_t i = 0; i < amplitude.size(); ++i) {
    const int x = static_cast<int>(i) % Emulated::kWidth, y = static_cast<int>(i) / Emulated::kWidth;
    ASSERT_EQ(amplitude[i], static_cast<float>(Emulated::intensity(x, y)));
  }
}

TEST_F(AravisFormats, PointsSayRangeDepthAndTheLens) {
  camera_.setFloatReg(Emulated::kFocal, 0.0);
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    camera_.setFloatReg(Emulated::kScale + 8 * axis, 1.0);
    camera_.setFloatReg(Emulated::kOffset + 8 * axis, 0.0);
  }
  for (const char* format : {"Coord3D_ABC32f", "Coord3D_ABC32f_Planar"}) {
    const auto source = started(fmt::format("components = ['Range']\npixel_format = '{}'", format));
    ASSERT_NE(source, nullptr);
    // Points of exactly such a camera in floats: the fit is as exact as they are.
    EXPECT_NEAR(source->info().camera.fx, Emulated::kFocal_px, 1e-2);
    EXPECT_NEAR(source->info().camera.cx, Emulated::kU_px, 1e-2);
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    const auto range_m = frame->find(PlaneKind::Range)->as<float>();
    const auto depth_m = frame->find(PlaneKind::Depth)->as<float>();
    const auto n =
        static_cast<std::uint64_t>(std::lround(1000.0F * depth_m[1])) - Emulated::rangeCode(0, 1, 0);
    const std::size_t at = 20 * Emulated::kWidth + 40;
    const double z_m = 1e-3 * Emulated::rangeCode(n, 40, 20);
    EXPECT_NEAR(depth_m[at], z_m, 1e-6);
    EXPECT_NEAR(range_m[at], z_m * std::hypot(1.0, 17.0 / 40.0, 4.0 / 40.0), 1e-6);
  }
}

TEST_F(AravisFormats, FloatCoordinatesAndSphericalOnesAreRead) {
  camera_.setReg(Emulated::kSystem, 1);
  const auto source = started("components = ['Range']\npixel_format = 'Coord3D_C32f'");
  ASSERT_NE(source, nullptr);
  const auto frame = nextFrame(*source);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  const std::size_t at = 20 * Emulated::kWidth + 40;
  const float range_m = frame->find(PlaneKind::Range)->as<float>()[at],
              depth_m = frame->find(PlaneKind::Depth)->as<float>()[at];
  EXPECT_NEAR(range_m, depth_m * std::hypot(1.0, 17.0 / 40.0, 4.0 / 40.0), 1e-6);
  const double code = (1000.0 * static_cast<double>(range_m) - Emulated::kOffset_mm) / Emulated::kScale_mm;
  EXPECT_NEAR(code, Emulated::rangeCode(0, 40, 20) + 32, 32) << "along the ray";
}

// ---- intensity and confidence --------------------------------------------------------------------

TEST_F(AravisFormats, IntensityAloneIsAmplitudeOf8Or16Bits) {
  for (const bool is_short : {false, true}) {
    camera_.setReg(Emulated::kFormat + 4, is_short ? Emulated::kMono8 : Emulated::kMono16);
    const auto source = started("components = ['Intensity']");
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().planes, std::vector{PlaneKind::Amplitude});
    const auto frame = nextFrame(*source);
    ASSERT_TRUE(frame.ok()) << frame.error().message;
    const auto amplitude = frame->find(PlaneKind::Amplitude)->as<float>();
    ASSERT_EQ(amplitude.size(), std::size_t{Emulated::kWidth} * Emulated::kHeight);
    for (std::size_t i = 0; i < amplitude.size(); ++i) {
      const int x = static_cast<int>(i) % Emulated::kWidth, y = static_cast<int>(i) / Emulated::kWidth;
      ASSERT_EQ(amplitude[i], static_cast<float>(Emulated::intensity(x, y) % (is_short ? 256 : 65'536)));
    }
  }
}

TEST_F(AravisFormats, ConfidenceOf8BitsIsComparedAsItComes) {
  camera_.setReg(Emulated::kFormat + 8, Emulated::kConfidence8);
  const auto source = started("least_confidence = 150");
  ASSERT_NE(source, nullptr);
  const auto frame = nextFrame(*source);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  const auto flags = frame->find(PlaneKind::Flags)->as<std::uint8_t>();
  int little = 0;
  for (std::size_t i = 0; i < flags.size(); ++i) {
    const int x = static_cast<int>(i) % Emulated::kWidth, y = static_cast<int>(i) / Emulated::kWidth;
    const bool is_little = Emulated::confidence(x, y) % 256 < 150;
    little += is_little ? 1 : 0;
    ASSERT_EQ((flags[i] & 8) != 0, is_little) << x << " " << y;
  }
  EXPECT_GT(little, 100);
  EXPECT_GT(std::ssize(flags) - little, 100);
}

TEST_F(AravisFormats, ConfidenceAloneIsNoImage) {
  expectRefused("components = ['Confidence']", "neither range nor intensity");
}

}  // namespace
}  // namespace toftwin::drivers::aravis
