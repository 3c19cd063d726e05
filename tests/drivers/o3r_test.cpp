// SPDX-License-Identifier: Apache-2.0
// What the driver o3r makes of a unit's configuration and of a head's frames.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>

#include "drivers/o3d303/wire/frame_content.h"
#include "drivers/o3r/frame_images.h"
#include "drivers/o3r/head.h"
#include "drivers/o3r/wire/head_frame.h"
#include "drivers/o3r/wire/numbers.h"

namespace toftwin::drivers::o3r {
namespace {

using toftwin::o3r::TofInfo;

TEST(O3rAddress, IsAnAddressAPortAndAHead) {
  EXPECT_EQ(*readAddress("o3r:192.168.0.69/port3"), (HeadAddress{"192.168.0.69", 80, "port3"}));
  EXPECT_EQ(*readAddress("o3r:10.0.0.1:8080"), (HeadAddress{"10.0.0.1", 8080, "port2"}));
  for (const char* uri : {"o3r:", "o3d303:10.0.0.1", "o3r:10.0.0.1/port6", "o3r:10.0.0.1/", "o3r:10.0.0.1:0", "o3r:10.0.0.1:x"})
    EXPECT_FALSE(readAddress(uri).ok()) << uri;
}

/// As the maker's manual shows a head.
const std::string kConfiguration =
    R"({"ports":{"port2":{"acquisition":{"exposureLong":5000,"exposureShort":400,"framerate":10.0,"offset":0,
    "version":{"major":0,"minor":0,"patch":0}},"data":{"algoDebugFlag":false,"pcicTCPPort":50012},
    "info":{"features":{"fov":{"horizontal":105,"vertical":78},"resolution":{"height":172,"width":224},"type":"3D"},
    "partNumber":"M03975","serialNumber":"000201234160"},"mode":"standard_range4m","state":"CONF"}}})";

TEST(O3rHead, IsReadFromTheConfiguration) {
  const auto head = readHead(kConfiguration, "port2");
  ASSERT_TRUE(head.ok()) << head.error().message;
  EXPECT_EQ(head->pcic_port, 50'012);
  EXPECT_EQ(head->serial, "000201234160");
  EXPECT_EQ(head->acquisition.at("exposureLong"), 5000.0);
  EXPECT_EQ(readHead(kConfiguration, "port3").error().code, Error::Code::NotFound);
  EXPECT_EQ(readHead("no JSON", "port2").error().code, Error::Code::NotFound);
  EXPECT_EQ(readHead(R"({"ports":{"port2":{"info":{"features":{"type":"2D"}}}}})", "port2").error().code,
            Error::Code::Incompatible);
}

TEST(O3rHead, OnlyWhatDiffersIsSet) {
  auto head = *readHead(kConfiguration, "port2");
  EXPECT_EQ(settingsFor(head, "port2", {{"exposureLong", 700.0}, {"framerate", 10.0}, {"nonsense", 1.0}}),
            R"({"ports":{"port2":{"acquisition":{"exposureLong":700.0},"state":"RUN"}}})");
  head.state = "RUN";
  EXPECT_EQ(settingsFor(head, "port2", {{"exposureLong", 5000.0}}), "");
}

TofInfo pinhole() {
  TofInfo info;
  info.distance_resolution_m = 0.5F;
  info.amplitude_resolution = 2.0F;
  info.exposures_s = {1e-4F, 1e-3F, 0.0F};
  info.inverse_intrinsics = {.model = 1};
  info.inverse_intrinsics.parameters = {100.0F, 101.0F, 2.5F, 1.5F};
  info.intrinsics = info.inverse_intrinsics;
  info.intrinsics.model = 0;
  return info;
}

TEST(O3rFrame, NumbersBecomeMetresAndFlags) {
  const auto info = pinhole();
  const auto optics = opticsOf(info, 3, 1);
  ASSERT_TRUE(optics.ok()) << optics.error().message;
  EXPECT_EQ(optics->camera.cx, 2.0) << "half a pixel from theirs";
  const std::vector<std::uint16_t> distance{4, 0, 6}, amplitude{4, 0, 1}, confidence{0x30, 0x31, 0x20 | 0x40};
  toftwin::o3r::HeadFrame sent;
  sent.width = 3;
  sent.height = 1;
  sent.distance = distance;
  sent.amplitude = amplitude;
  sent.confidence = confidence;
  sent.tof_info = info;
  using namespace toftwin::o3r;
  const auto bytes = writeHeadFrame(schemaOf({kDistanceBlob, kAmplitudeBlob, kConfidenceBlob, kTofInfoBlob}), sent);
  const auto content = toftwin::o3d303::readFrameContent(*bytes);
  ASSERT_TRUE(content.ok()) << content.error().message;
  const auto planes = planesOf(*content, *infoOf(*content), *optics);
  ASSERT_TRUE(planes.ok()) << planes.error().message;
  const auto range_m = (*planes)[0].as<float>(), strength = (*planes)[2].as<float>();
  EXPECT_EQ(range_m[0], 2.0F);
  EXPECT_TRUE(std::isnan(range_m[1]));
  EXPECT_EQ(range_m[2], 3.0F);
  EXPECT_EQ(strength[0], 18.0F);
  EXPECT_TRUE(std::isnan(strength[1]));
  const auto flags = (*planes)[3].as<std::uint8_t>(), exposure = (*planes)[4].as<std::uint8_t>();
  EXPECT_EQ(flags[1], static_cast<int>(PixelFlag::Invalid));
  EXPECT_EQ(flags[2], static_cast<int>(PixelFlag::OutOfRange));
  EXPECT_EQ(exposure[2], 1) << "the shorter of two";
}

TEST(O3rFrame, AFishEyesLensIsFitted) {
  TofInfo info = pinhole();
  info.intrinsics = {.model = 2};
  info.intrinsics.parameters = {120.0F, 120.0F, 32.0F, 24.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 10.0F};
  info.inverse_intrinsics = {.model = 3};
  const auto optics = opticsOf(info, 64, 48);
  ASSERT_TRUE(optics.ok()) << optics.error().message;
  EXPECT_NEAR(optics->camera.cx, 31.5, 0.01);
  const double theta = std::hypot(31.5, 23.5) / 120.0;
  EXPECT_NEAR(optics->depth_per_range[0], std::cos(theta), 1e-6);
}

TEST(O3rFrame, OfARealHeadIsRead) {
  const char* named = std::getenv("TOFTWIN_DATA");
  const std::string data = named != nullptr ? named : std::string{TOFTWIN_SOURCE_DIR} + "/../shared/data";
  std::ifstream in{data + "/ifm-o3r-frame/O3RBuffer.data", std::ios::binary};
  if (!in) in.open(std::string{TOFTWIN_SOURCE_DIR} + "/../../shared/data/ifm-o3r-frame/O3RBuffer.data", std::ios::binary);
  if (!in) GTEST_SKIP() << "no ifm-o3r-frame in $TOFTWIN_DATA or ../shared/data";
  const std::string all{std::istreambuf_iterator<char>{in}, {}};
  const auto content = toftwin::o3d303::readFrameContent(std::as_bytes(std::span{all}).subspan(4, all.size() - 6));
  const auto info = infoOf(*content);
  ASSERT_TRUE(info.ok()) << info.error().message;
  const auto optics = opticsOf(*info, 224, 172);
  ASSERT_TRUE(optics.ok()) << optics.error().message;
  EXPECT_NEAR(optics->camera.fx, 124.344284, 1e-5);
  const auto planes = planesOf(*content, *info, *optics);
  ASSERT_TRUE(planes.ok()) << planes.error().message;
  int valid = 0;
  float longest_m = 0.0F;
  for (const float one : (*planes)[0].as<float>()) {
    valid += std::isnan(one) ? 0 : 1;
    longest_m = std::fmax(longest_m, one);
  }
  EXPECT_EQ(valid, 9962) << "as the file's own description counts";
  EXPECT_NEAR(longest_m, 1.97, 0.01);
  // Both of the head's lens models say the same: from a pixel to a ray, and back.
  for (const auto& [u, v] : {std::pair{0, 0}, {223, 171}, {40, 100}}) {
    const auto ray = toftwin::o3r::rayOf(info->intrinsics, u, v);
    const auto ours = rayThroughPixel(optics->camera, u, v).v;
    EXPECT_NEAR(ray[0], ours.x, 0.02);
    EXPECT_NEAR(ray[1], ours.y, 0.02);
  }
}

}  // namespace
}  // namespace toftwin::drivers::o3r
