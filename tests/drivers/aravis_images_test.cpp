// SPDX-License-Identifier: Apache-2.0
// What bytes of a camera become, and that no bytes do harm.
#include "drivers/aravis/images.h"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <random>

#include "aravis_fuzz_one_input.h"
#include "drivers/aravis/discovery.h"

namespace toftwin::drivers::aravis {
namespace {

std::vector<std::byte> little(std::initializer_list<std::uint16_t> codes) {
  std::vector<std::byte> bytes;
  for (const std::uint16_t code : codes) {
    bytes.push_back(static_cast<std::byte>(code & 0xFFU));
    bytes.push_back(static_cast<std::byte>(code >> 8U));
  }
  return bytes;
}
std::vector<std::byte> little(std::initializer_list<float> values) {
  std::vector<std::byte> bytes;
  for (const float value : values) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    for (unsigned i = 0; i < 4; ++i) bytes.push_back(static_cast<std::byte>(bits >> (8 * i)));
  }
  return bytes;
}

constexpr std::uint32_t kC16 = 0x011000B8, kABC32f = 0x026000C0, kABC16Planar = 0x023000BA,
                        kMono16 = 0x01100007, kMono8 = 0x01080001, kConfidence8 = 0x010800C6;

Lens lens(int width, int height, bool is_known = true) {
  LensKeys keys;
  if (is_known) keys = {.fx = 2.0, .cx = 0.0, .cy = 0.0};
  return *lensFor(keys, width, height, "test");
}
Scan3d scan() {
  Scan3d scan;
  scan.axes[2] = {.scale = 0.5, .offset = 100.0, .invalid = 0.0};
  return scan;
}
std::span<const float> plane(const std::vector<Plane>& planes, PlaneKind kind) {
  for (const Plane& one : planes) {
    if (one.kind == kind) return one.as<float>();
  }
  return {};
}

TEST(AravisImages, ACoordinateIsScaledShiftedAndInvalidAtItsCode) {
  const ImageMaker maker{{.has_range = true}, scan(), lens(3, 1)};
  const auto bytes = little({std::uint16_t{1800}, std::uint16_t{0}, std::uint16_t{65535}});
  const std::array parts{Part{.bytes = bytes, .width = 3, .height = 1, .format = kC16}};
  const auto planes = maker.planes(parts);
  ASSERT_TRUE(planes.ok()) << planes.error().message;
  const auto depth_m = plane(*planes, PlaneKind::Depth), range_m = plane(*planes, PlaneKind::Range);
  EXPECT_FLOAT_EQ(depth_m[0], 1.0F) << "0.5 · 1800 + 100 mm";
  EXPECT_TRUE(std::isnan(depth_m[1]) && std::isnan(range_m[1]));
  EXPECT_FLOAT_EQ(depth_m[2], 32.8675F);
  EXPECT_FLOAT_EQ(range_m[0], 1.0F) << "on the axis";
  EXPECT_FLOAT_EQ(range_m[2], 32.8675F * std::sqrt(2.0F)) << "45 degrees beside it";
  EXPECT_EQ((*planes)[2].as<std::uint8_t>()[1], 1);
}

TEST(AravisImages, SphericalCoordinatesAreRange) {
  Scan3d spherical = scan();
  spherical.c_is_range = true;
  const ImageMaker maker{{.has_range = true}, spherical, lens(3, 1)};
  const auto bytes = little({std::uint16_t{1800}, std::uint16_t{0}, std::uint16_t{1800}});
  const std::array parts{Part{.bytes = bytes, .width = 3, .height = 1, .format = kC16}};
  const auto planes = maker.planes(parts);
  ASSERT_TRUE(planes.ok());
  EXPECT_FLOAT_EQ(plane(*planes, PlaneKind::Range)[2], 1.0F);
  EXPECT_FLOAT_EQ(plane(*planes, PlaneKind::Depth)[2], 1.0F / std::sqrt(2.0F));
}

TEST(AravisImages, WithoutALensOnlyWhatWasMeasuredIsThere) {
  const ImageMaker depth{{.has_range = true}, scan(), lens(3, 1, false)};
  EXPECT_EQ(depth.kinds(), (std::vector{PlaneKind::Depth, PlaneKind::Flags}));
  Scan3d spherical = scan();
  spherical.c_is_range = true;
  const ImageMaker range{{.has_range = true}, spherical, lens(3, 1, false)};
  EXPECT_EQ(range.kinds(), (std::vector{PlaneKind::Range, PlaneKind::Flags}));
  const ImageMaker intensity{{.has_intensity = true}, {}, lens(3, 1, false)};
  EXPECT_EQ(intensity.kinds(), (std::vector{PlaneKind::Amplitude}));
}

TEST(AravisImages, APointSaysRangeAndDepthWithoutALens) {
  const ImageMaker maker{{.has_range = true, .has_points = true}, {}, lens(2, 1, false)};
  const float nan = std::nanf("");
  const auto bytes = little({300.0F, 400.0F, 1200.0F, nan, nan, nan});
  const std::array parts{Part{.bytes = bytes, .width = 2, .height = 1, .format = kABC32f}};
  const auto planes = maker.planes(parts);
  ASSERT_TRUE(planes.ok()) << planes.error().message;
  EXPECT_FLOAT_EQ(plane(*planes, PlaneKind::Range)[0], 1.3F) << "3-4-12-13";
  EXPECT_FLOAT_EQ(plane(*planes, PlaneKind::Depth)[0], 1.2F);
  EXPECT_TRUE(std::isnan(plane(*planes, PlaneKind::Range)[1]));
}

TEST(AravisImages, EachAxisHasItsOwnScaleOffsetAndInvalidCodeAlsoInPlanes) {
  Scan3d three;
  three.axes = {{{.scale = 1.0, .offset = -1000.0},
                 {.scale = 2.0, .offset = 0.0},
                 {.scale = 4.0, .offset = 0.0, .invalid = 7.0}}};
  const ImageMaker maker{{.has_range = true, .has_points = true}, three, lens(2, 1, false)};
  // A A, pad, B B, pad, C C: a plane's rows end like others
  const auto bytes =
      little({std::uint16_t{1300}, std::uint16_t{1}, std::uint16_t{99}, std::uint16_t{200},
              std::uint16_t{1}, std::uint16_t{99}, std::uint16_t{300}, std::uint16_t{7}});
  const std::array parts{
      Part{.bytes = bytes, .width = 2, .height = 1, .row_padding = 2, .format = kABC16Planar}};
  const auto planes = maker.planes(parts);
  ASSERT_TRUE(planes.ok()) << planes.error().message;
  EXPECT_FLOAT_EQ(plane(*planes, PlaneKind::Range)[0], 1.3F);
  EXPECT_TRUE(std::isnan(plane(*planes, PlaneKind::Depth)[1])) << "C has the code";
}

TEST(AravisImages, LittleConfidenceIsInvalidWhateverTheRangeSays) {
  const ImageMaker maker{
      {.has_range = true, .has_intensity = true, .has_confidence = true, .least_confidence = 10.0},
      scan(),
      lens(2, 1)};
  const auto range = little({std::uint16_t{1800}, std::uint16_t{1800}});
  const auto strength = little({std::uint16_t{513}, std::uint16_t{2}});
  const std::vector confidence{std::byte{9}, std::byte{10}};
  const std::array parts{
      Part{.bytes = strength, .width = 2, .height = 1, .format = kMono16, .component = 2},
      Part{.bytes = confidence, .width = 2, .height = 1, .format = kConfidence8, .component = 6},
      Part{.bytes = range, .width = 2, .height = 1, .format = kC16, .component = 4}};
  const auto planes = maker.planes(parts);
  ASSERT_TRUE(planes.ok()) << planes.error().message;
  ASSERT_EQ(planes->size(), 4u);
  EXPECT_TRUE(std::isnan(plane(*planes, PlaneKind::Range)[0]));
  EXPECT_FALSE(std::isnan(plane(*planes, PlaneKind::Range)[1]));
  EXPECT_EQ((*planes)[3].as<std::uint8_t>()[0], 1 | 8) << "invalid, low amplitude";
  EXPECT_EQ(plane(*planes, PlaneKind::Amplitude)[0], 513.0F);
}

TEST(AravisImages, OfSeveralIntensitiesThatOfTheComponentIntensityIsTaken) {
  const std::vector one{std::byte{1}};
  const std::array parts{
      Part{.bytes = one,
           .width = 1,
           .height = 1,
           .format = kMono8,
           .component = 4,
           .is_range = true},
      Part{.bytes = one, .width = 1, .height = 1, .format = kMono8, .component = 2},
      Part{.bytes = one, .width = 1, .height = 1, .format = kMono8, .component = 1}};
  EXPECT_EQ(partFor(Role::Intensity, parts), &parts[2]);
  EXPECT_EQ(partFor(Role::Intensity, std::span{parts}.first(2)), &parts[1]);
  EXPECT_EQ(partFor(Role::Range, parts), &parts[0]) << "grey values of a range component";
  EXPECT_EQ(partFor(Role::Confidence, parts), nullptr);
}

TEST(AravisImages, WhatIsMissingOrOfAnotherSizeIsSaid) {
  const ImageMaker maker{{.has_range = true}, scan(), lens(3, 2)};
  const std::vector<std::byte> bytes(11);
  const auto says = [&](const Part& part) {
    return maker.planes(std::array{part}).error().message;
  };
  const Part good{.bytes = bytes, .width = 3, .height = 2, .format = kC16};
  EXPECT_NE(says(good).find("has 11 bytes, 3 x 2 pixels need 12"), std::string::npos) << says(good);
  Part other = good;
  other.width = 4;
  EXPECT_NE(says(other).find("is 4 x 2, the camera had 3 x 2"), std::string::npos);
  other = good;
  other.format = 0x12345678;
  EXPECT_NE(says(other).find("no range image"), std::string::npos);
  other = good;
  other.format = kABC32f;
  EXPECT_NE(says(other).find("another pixel format"), std::string::npos);
  other = good;
  other.row_padding = -4;
  EXPECT_FALSE(maker.planes(std::array{other}).ok());
  EXPECT_FALSE(maker.planes({}).ok());
}

TEST(AravisImages, NoBytesLeadOutsideOfThem) {
  constexpr unsigned kSeed = 1;
  std::mt19937 random{kSeed};
  for (int i = 0; i < 20'000; ++i) {
    std::vector<std::byte> bytes(random() % 400);
    for (std::byte& one : bytes) one = static_cast<std::byte>(random());
    fuzzOneInput(bytes);
  }
  SUCCEED() << "seed " << kSeed;
}

TEST(AravisDiscovery, AnAnswerSaysWhichCameraItIs) {
  std::vector<std::byte> answer(8 + 248);
  const auto put = [&](std::size_t at, std::string_view text) {
    for (std::size_t i = 0; i < text.size(); ++i)
      answer[8 + at + i] = static_cast<std::byte>(text[i]);
  };
  answer[3] = std::byte{3};
  answer[7] = std::byte{1};
  put(0x0A, "\x02\x11\xAB\x01\x02\x03");
  put(0x48, "Maker");
  put(0x68, "ToF \x1B[2J 1");
  put(0xD8, "0123456789ABCDEF");
  put(0xE8, "dock");
  const auto camera = readDiscoveryAnswer(answer, 1);
  ASSERT_TRUE(camera.has_value());
  EXPECT_EQ(camera->name(), "Maker-ToF [2J 1-0123456789ABCDEF") << "no escape reaches a terminal";
  EXPECT_EQ(camera->mac, "02:11:ab:01:02:03");
  for (const char* called : {"dock", "0123456789ABCDEF", "02:11:AB:01:02:03"})
    EXPECT_TRUE(camera->isCalled(called)) << called;
  EXPECT_FALSE(camera->isCalled("0123"));
  EXPECT_FALSE(readDiscoveryAnswer(answer, 2)) << "an answer to somebody else";
  answer.pop_back();
  EXPECT_FALSE(readDiscoveryAnswer(answer, 1));
}

TEST(AravisDiscovery, AddressesAreReadAndWritten) {
  EXPECT_EQ(addressOf("192.168.0.20"), 0xC0A80014U);
  EXPECT_EQ(textOf(0xC0A80014U), "192.168.0.20");
  for (const char* no : {"192.168.0", "256.0.0.1", "any", "", "::1"}) EXPECT_FALSE(addressOf(no));
}

}  // namespace
}  // namespace toftwin::drivers::aravis
