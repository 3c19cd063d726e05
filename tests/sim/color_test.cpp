// SPDX-License-Identifier: Apache-2.0
// Colour from the colour lens's own place, and its registration with depth.
#include "sim/sensor/color.h"

#include <gmock/gmock.h>

#include <cmath>

#include "tests/sim/camera_testing.h"

namespace toftwin::sim {
namespace {

using testing::HasSubstr;

CameraInfo pinhole(int width, int height, double f) {
  CameraInfo camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = f;
  camera.cx = (width - 1) / 2.0;
  camera.cy = (height - 1) / 2.0;
  return camera;
}

/// A colour lens 50 mm to the left of the depth lens: what stands at x for one is at x + 0.05 m for
/// the other.
LensPair besideEachOther() {
  return {
      pinhole(81, 61, 80.0), pinhole(161, 121, 160.0), {{1.0, 0.0, 0.0, 0.0}, {0.05, 0.0, 0.0}}};
}

DecodeRays raysOf(const CameraInfo& camera) {
  DecodeRays rays{Image<float>{camera.width, camera.height},
                  Image<float>{camera.width, camera.height}};
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vec3d ray = rayThroughPixel(camera, x, y).v;
      rays.x(x, y) = static_cast<float>(ray.x);
      rays.z(x, y) = static_cast<float>(ray.z);
    }
  }
  return rays;
}

/// Ranges of a wall 2 m ahead, with a plate 1 m ahead over the columns from `first` to `last`.
Image<float> wallWithPlate(const DecodeRays& rays, int first, int last) {
  Image<float> range_m{rays.z.width(), rays.z.height()};
  for (int y = 0; y < range_m.height(); ++y) {
    for (int x = 0; x < range_m.width(); ++x)
      range_m(x, y) = (x >= first && x <= last ? 1.0F : 2.0F) / rays.z(x, y);
  }
  return range_m;
}

// The wall's plane is exact wherever the depth image reaches: 1/z is linear in the image of a
// plane.
TEST(Registration, DepthOfAWallIsThatOfTheWall) {
  const LensPair lenses = besideEachOther();
  const DecodeRays rays = raysOf(lenses.depth);
  const Image<float> depth_m = depthInColor(lenses, rays, wallWithPlate(rays, -1, -1));
  // Depth pixels 0 and 80 are at −1 and +1 m on the wall, which the colour lens sees at −0.95
  // and 1.05 m.
  const double left = lenses.color.cx - 160.0 * 0.95 / 2.0;
  for (int u = 0; u < 161; ++u) {
    if (std::abs(u - left) < 0.5) continue;  // rounding decides
    const bool is_seen = u >= left && u <= lenses.color.cx + 160.0 * 1.05 / 2.0;
    ASSERT_EQ(!std::isnan(depth_m(u, 60)), is_seen) << u;
    if (is_seen) {
      ASSERT_NEAR(depth_m(u, 60), 2.0, 1e-5) << u;
    }
  }
}

TEST(Registration, WhatIsNearerHidesWhatIsBehind) {
  const LensPair lenses = besideEachOther();
  const DecodeRays rays = raysOf(lenses.depth);
  const Image<float> range_m = wallWithPlate(rays, 30, 50);
  const Image<float> depth_m = depthInColor(lenses, rays, range_m);
  // The plate's columns 30 and 50 are at −0.125 and +0.125 m, 1 m ahead: the colour lens sees them
  // at −0.075 and 0.175 m.
  EXPECT_NEAR(depth_m(80 - 11, 60), 1.0F, 1e-5F);
  EXPECT_NEAR(depth_m(80 + 27, 60), 1.0F, 1e-5F);
  EXPECT_FALSE(depth_m(80 - 14, 60) < 1.5F);
  EXPECT_FALSE(depth_m(80 + 30, 60) < 1.5F);
}

/// An image whose red is its column and whose green its row.
ColorImage ruled(const CameraInfo& camera) {
  ColorImage color;
  color.fill(Image<std::uint8_t>{camera.width, camera.height});
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      color[0](u, v) = static_cast<std::uint8_t>(u);
      color[1](u, v) = static_cast<std::uint8_t>(v);
      color[2](u, v) = 255;
    }
  }
  return color;
}

TEST(Registration, EachDepthPixelHasTheColourOfItsPlace) {
  const LensPair lenses = besideEachOther();
  const DecodeRays rays = raysOf(lenses.depth);
  const Image<float> range_m = wallWithPlate(rays, -1, -1);
  const ColorImage color =
      colorInDepth(lenses, rays, range_m, depthInColor(lenses, rays, range_m), ruled(lenses.color));
  for (int x = 5; x < 70; ++x) {
    const double u = 80.0 + 160.0 * ((x - 40) / 80.0 * 2.0 + 0.05) / 2.0;
    ASSERT_NEAR(color[0](x, 20), u, 0.5001) << x;
    ASSERT_NEAR(color[1](x, 20), 60.0 + 160.0 * (20 - 30) / 80.0, 0.5001);
  }
}

TEST(Registration, WhatTheColourLensDoesNotSeeIsBlack) {
  const LensPair lenses = besideEachOther();
  const DecodeRays rays = raysOf(lenses.depth);
  const Image<float> range_m = wallWithPlate(rays, 30, 50);
  const ColorImage color =
      colorInDepth(lenses, rays, range_m, depthInColor(lenses, rays, range_m), ruled(lenses.color));
  const auto isBlack = [&](int x) { return color[2](x, 30) == 0; };
  for (int x = 5; x < 30; ++x) EXPECT_FALSE(isBlack(x)) << x;
  for (int x = 31; x < 50; ++x) EXPECT_FALSE(isBlack(x)) << x;
  // The plate's right edge at 0.125 m, seen from −0.05 m, hides the wall up to x = 0.30 m:
  // column 52.
  EXPECT_TRUE(isBlack(51));
  for (int x = 54; x < 75; ++x) EXPECT_FALSE(isBlack(x)) << x;
}

TEST(Registration, InvalidPixelsHaveNoColour) {
  const LensPair lenses = besideEachOther();
  const DecodeRays rays = raysOf(lenses.depth);
  Image<float> range_m = wallWithPlate(rays, -1, -1);
  range_m(40, 30) = std::nanf("");
  const ColorImage color =
      colorInDepth(lenses, rays, range_m, depthInColor(lenses, rays, range_m), ruled(lenses.color));
  EXPECT_EQ(color[2](40, 30), 0);
  EXPECT_EQ(color[2](41, 30), 255);
}

constexpr std::string_view kColoured = R"(
[ambient]
radiance_w_per_m2_sr = 1.0
[[material]]
name = "red"
albedo = 0.9
color = [0.8, 0.2, 0.05]
[[object]]
shape = "rectangle"
size_m = [40, 40, 0]
position_m = [0, 0, 2]
material = "red"
)";

Result<Light> traced(const Scene& scene, const TraceRequest& request) {
  return trace(scene, request);
}

ColorRequest small() {
  LensPair lenses = besideEachOther();
  lenses.color = pinhole(16, 12, 16.0);
  return {.lenses = lenses, .world_from_camera = {}, .samples_per_pixel = 64, .max_surfaces = 2};
}

// sRGB of the share: 1 for white, which red is here. The evenly lit wall is even: its ratios are
// those of the colours.
TEST(Color, HasTheMaterialsColours) {
  ColorRequest request = small();
  request.samples_per_pixel = 4096;
  const auto image = renderColor(*parseVisible(kColoured, "scene.toml"), request, traced);
  ASSERT_TRUE(image);
  const auto srgb = [](double l) { return 255.0 * (1.055 * std::pow(l, 1.0 / 2.4) - 0.055); };
  // Noise: half of the blue paths end by roulette, 1/√4096 of the value, 0.5 of 255; rounding and white level the rest.
  EXPECT_NEAR((*image)[0](8, 6), 255.0, 2.0);
  EXPECT_NEAR((*image)[1](8, 6), srgb(0.25), 2.0);
  EXPECT_NEAR((*image)[2](8, 6), srgb(0.0625), 2.0);
}

TEST(Color, ASceneWithoutLightGetsALamp) {
  std::string dark{kColoured};
  dark.replace(dark.find("= 1.0"), 5, "= 0.0");
  const auto image = renderColor(*parseVisible(dark, "scene.toml"), small(), traced);
  ASSERT_TRUE(image);
  EXPECT_GT((*image)[0](8, 6), 100);
  EXPECT_GT((*image)[0](8, 6), (*image)[1](8, 6));
}

TEST(Color, InfraredDoesNotSeeIt) {
  const auto infrared = Scene::parse(kColoured, "scene.toml"),
             red = Scene::parse(kColoured, "scene.toml", Band::Red);
  TraceRequest request;
  request.camera = pinhole(4, 4, 4.0);
  EXPECT_NEAR(trace(*infrared, request).truth.albedo(1, 1), 0.9, 1e-6);
  EXPECT_NEAR(trace(*red, request).truth.albedo(1, 1), 0.8, 1e-6);
}

TEST(Color, OfTwoNumbersIsAnError) {
  const auto scene = Scene::parse("[[material]]\nname = 'a'\ncolor = [0.1, 0.2]\n", "scene.toml");
  ASSERT_FALSE(scene);
  EXPECT_THAT(scene.error().message, HasSubstr("three numbers"));
}

TEST(Color, TheKinectsLensStandsToTheLeftAndItsSmallerImageSeesTheSame) {
  const auto lenses = SensorModel::preset("kinect_v2")->colorLens();
  ASSERT_TRUE(lenses);
  EXPECT_NEAR((lenses->color_from_camera * Point<Camera>{{0.0, 0.0, 1.0}}).m.x, 0.052, 1e-12);
  EXPECT_EQ(lenses->color.width, 960);
  EXPECT_EQ(lenses->color.height, 540);
  CameraInfo whole = pinhole(1920, 1080, 1081.37);
  const CameraInfo half = scaled(whole, 0.5);
  // The corner of a pixel of the smaller image is a corner between pixels of the larger one.
  const Vec3d a = rayThroughPixel(half, 99.5, 99.5).v, b = rayThroughPixel(whole, 199.5, 199.5).v;
  EXPECT_NEAR(norm(a - b), 0.0, 1e-9);
  EXPECT_FALSE(SensorModel::preset("o3d303")->colorLens());
}

}  // namespace
}  // namespace toftwin::sim
