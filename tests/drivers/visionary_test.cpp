// SPDX-License-Identifier: Apache-2.0
// What the driver visionary makes of a camera's description and images.
#include <gtest/gtest.h>

#include <cmath>

#include "drivers/visionary/frame_images.h"

namespace toftwin::drivers::visionary {
namespace {

/// The numbers of a real camera, as the maker's tests have them.
const char* const kDescription =
    R"(<?xml version="1.0" encoding="UTF-8"?><SickRecord><DataSets><DataSetDepthMap id="1"><DeviceDescription>
    <Ident>Visionary-T Mini CX V3S105-1x</Ident><SerialNumber>12345678</SerialNumber></DeviceDescription>
    <FormatDescriptionDepthMap><DataStream><Width>512</Width><Height>424</Height><CameraToWorldTransform>
    <value>1.0</value><value>0.0</value><value>0.0</value><value>0.0</value></CameraToWorldTransform>
    <CameraMatrix><FX>-366.964999</FX><FY>-367.057999</FY><CX>252.118999</CX><CY>205.213999</CY></CameraMatrix>
    <CameraDistortionParams><K1>-0.076050</K1><K2>0.217518</K2></CameraDistortionParams>
    <Distance decimalexponent="0" min="1" max="16384">uint16</Distance><Intensity>uint16</Intensity>
    <Confidence>uint16</Confidence></DataStream></FormatDescriptionDepthMap></DataSetDepthMap></DataSets></SickRecord>)";

TEST(VisionaryOptics, OfARealCameraAreFittedToItsRays) {
  const auto description = toftwin::visionary::readDescription(kDescription);
  ASSERT_TRUE(description.ok()) << description.error().message;
  EXPECT_EQ(description->serial, "12345678");
  const auto optics = opticsOf(*description);
  ASSERT_TRUE(optics.ok()) << optics.error().message;
  EXPECT_GT(optics->camera.fx, 0.0);
  // The maker's formula for the first pixel, by hand.
  const double x = 252.118999 / 366.964999, y = 205.213999 / 367.057999, r2 = x * x + y * y;
  const double k = 1.0 - 0.07605 * r2 + 0.217518 * r2 * r2;
  EXPECT_NEAR(optics->depth_per_range[0], 1.0 / std::sqrt(1.0 + k * k * r2), 1e-6);
  const Vec3d ours = rayThroughPixel(optics->camera, 0, 0).v;
  EXPECT_NEAR(ours.x / ours.z, -x * k, 0.01);
  EXPECT_NEAR(ours.y / ours.z, -y * k, 0.01);
}

TEST(VisionaryOptics, WithoutALensAreNone) {
  toftwin::visionary::Description description;
  description.width = description.height = 2;
  EXPECT_EQ(opticsOf(description).error().code, Error::Code::Incompatible);
}

TEST(VisionaryImages, CountsAreQuartersOfAMillimetre) {
  toftwin::visionary::Description description;
  description.width = 3;
  description.height = 1;
  description.fx = description.fy = -100.0;
  description.cx = 1.0;
  const auto optics = opticsOf(description);
  ASSERT_TRUE(optics.ok()) << optics.error().message;
  const auto planes = planesOf({.distance = {4000, 0, 65'535}, .intensity = {1, 2, 3}, .state = {9, 9, 9}}, *optics);
  ASSERT_TRUE(planes.ok()) << planes.error().message;
  const auto range_m = (*planes)[0].as<float>();
  EXPECT_EQ(range_m[0], 1.0F);
  EXPECT_TRUE(std::isnan(range_m[1]) && std::isnan(range_m[2]));
  EXPECT_EQ((*planes)[3].as<std::uint8_t>()[2], static_cast<int>(PixelFlag::Invalid));
  EXPECT_NEAR((*planes)[1].as<float>()[0], 1.0 / std::sqrt(1.0 + 1e-4), 1e-6);
  EXPECT_FALSE(planesOf({.distance = {1}}, *optics).ok());
}

}  // namespace
}  // namespace toftwin::drivers::visionary
