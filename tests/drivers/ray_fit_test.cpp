// SPDX-License-Identifier: Apache-2.0
#include "drivers/ray_fit.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace toftwin::drivers {
namespace {

std::vector<float> raysOf(const CameraInfo& camera) {
  std::vector<float> rays;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Vec3d ray = rayThroughPixel(camera, u, v).v;
      for (const double e : {ray.x, ray.y, ray.z}) rays.push_back(static_cast<float>(e));
    }
  }
  return rays;
}

// A lens with the strong distortion of the O3D303 of our reference data. Rays are floats, 6e-8 of
// at most 1 each: on 180 pixels 1e-5 px, of which a fit to 4000 of them keeps less than that.
TEST(FitCamera, FindsALensWithStrongDistortion) {
  const CameraInfo truth{.width = 176,
                         .height = 132,
                         .fx = 177.3,
                         .fy = 177.7,
                         .cx = 87.1,
                         .cy = 71.5,
                         .distortion = {-0.437, 0.283, -0.003, 0.003, -0.158},
                         .calibration_id = {}};
  std::vector<float> rays = raysOf(truth);
  for (std::size_t i = 0; i < 30; ++i) rays[i] = std::numeric_limits<float>::quiet_NaN();
  const auto fitted = fitCamera(truth.width, truth.height, rays);
  ASSERT_TRUE(fitted.ok()) << fitted.error().message;
  EXPECT_LT(fitted->rms_px, 1e-4);
  for (const auto& [u, v] : {std::pair{0, 0}, {175, 0}, {88, 66}, {175, 131}}) {
    const auto seen = pixelOfPoint(fitted->camera, {rayThroughPixel(truth, u, v).v});
    EXPECT_NEAR(seen[0], u, 1e-3);
    EXPECT_NEAR(seen[1], v, 1e-3);
  }
}

TEST(FitCamera, RaysThatAreNoCamerasAreRefused) {
  EXPECT_FALSE(fitCamera(16, 16, std::vector<float>(3 * 256, 0.0F)).ok());
  EXPECT_FALSE(fitCamera(16, 16, std::vector<float>(3 * 256, 1.0F)).ok()) << "all the same";
  EXPECT_FALSE(fitCamera(16, 16, std::vector<float>(10, 1.0F)).ok()) << "too few";
  EXPECT_FALSE(fitCamera(0, 0, {}).ok());
}

}  // namespace
}  // namespace toftwin::drivers
