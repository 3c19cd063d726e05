// SPDX-License-Identifier: Apache-2.0
// How many surfaces a capture's light has been at, where nobody says it.
#include <gtest/gtest.h>

#include <numeric>
#include <stdexcept>

#include "calib/discover/campaign/captures/campaign.h"
#include "tests/discover/simulated_run.h"

namespace toftwin::discover {
namespace {

/// A bright corner of 60°, in which light goes to and fro.
constexpr auto kCorner = R"(
[[material]]
name = "white"
albedo = 0.9
[[object]]
name = "right"
shape = "rectangle"
size_m = [2.0, 2.0, 0.0]
position_m = [0.5, 0.0, 1.1339746]
euler_deg = [0.0, 60.0, 0.0]
material = "white"
[[object]]
name = "left"
shape = "rectangle"
size_m = [2.0, 2.0, 0.0]
position_m = [-0.5, 0.0, 1.1339746]
euler_deg = [0.0, 120.0, 0.0]
material = "white"
)";

/// The sum of all pixels' light.
double brightness(bool is_simulated, std::optional<int> max_surfaces = {}) {
  const auto model = sim::SensorModel::parse(smallCamera(), "camera.toml");
  const auto scene = sim::Scene::parse(kCorner, "scene.toml");
  if (!model || !scene) throw std::runtime_error("the camera or the scene is wrong");
  MeasuredCapture capture;
  capture.is_simulated = is_simulated;
  capture.moment.world_from_camera = Transform<World, Camera>{};
  const auto all = traceAll({*model, *scene}, {capture}, {.samples_per_pixel = 16, .max_surfaces = max_surfaces});
  if (!all) throw std::runtime_error(all.error().message);
  const auto& pixels = all->front()->light.steady.pixels();
  return std::accumulate(pixels.begin(), pixels.end(), 0.0);
}

TEST(TracedSurfaces, AreSixteenOfARealCameraAndASourcesDefaultOfASimulatedOne) {
  EXPECT_EQ(brightness(true), brightness(true, 4));
  EXPECT_EQ(brightness(false), brightness(true, 16));
  EXPECT_EQ(brightness(false, 2), brightness(true, 2));
  EXPECT_GT(brightness(false), 1.01 * brightness(true));
}

}  // namespace
}  // namespace toftwin::discover
