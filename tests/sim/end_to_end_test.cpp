// SPDX-License-Identifier: Apache-2.0
// From a scene to ranges, through tracer, sensor and decoder.
#include <gtest/gtest.h>

#include <cmath>

#include "sim/sensor/sensor_model.h"
#include "sim/tracer/trace.h"

namespace toftwin::sim {
namespace {

constexpr std::string_view kWall = R"(
[[material]]
name = "white"
albedo = 0.8
[[object]]
shape = "rectangle"
size_m = [40, 40, 0]
position_m = [0, 0, 2]
euler_deg = [0, 25, 0]
material = "white"
)";
constexpr std::string_view kBoxBeforeWall = R"(
[[material]]
name = "white"
albedo = 0.8
[[object]]
shape = "rectangle"
size_m = [40, 40, 0]
position_m = [0, 0, 3]
material = "white"
[[object]]
shape = "rectangle"
size_m = [0.713, 0.713, 0]
position_m = [0, 0, 1.5]
material = "white"
)";

Scene sceneOf(std::string_view toml) {
  auto scene = Scene::parse(toml, "test scene");
  if (!scene) throw std::runtime_error{scene.error().message};
  return *std::move(scene);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error{"no \"" + from + "\" in the preset"};
  return text.replace(at, from.size(), to);
}

/// The preset without its filters, which look at neighbours and so smooth a slanted wall.
std::string withoutFilters() {
  const std::string text =
      replaced(*SensorModel::presetText("kinect_v2"), "bilateral_filter = true", "bilateral_filter = false");
  return replaced(text, "edge_filter = true", "edge_filter = false");
}

/// A Kinect v2 without imperfections: sines, the exact baseline, no noise, no filters.
SensorModel idealKinect() {
  std::string text = withoutFilters();
  text = replaced(text, "emitted = \"clipped_sine\"", "emitted = \"sine\"");
  text = replaced(text, "baseline_correction = \"first_order\"", "baseline_correction = \"exact\"");
  auto model = SensorModel::parse(text, "ideal");
  if (!model) throw std::runtime_error{model.error().message};
  return model->withEffects({});
}

Light direct(const SensorModel& model, std::string_view scene, double pixel_extent, int samples,
             int only_row = -1) {
  TraceRequest request = model.traceRequest();
  request.samples_per_pixel = samples;
  request.max_surfaces = 1;
  request.pixel_extent = pixel_extent;
  if (only_row >= 0) {
    request.region_y = only_row;
    request.region_width = request.camera.width;
    request.region_height = 1;
  }
  return trace(sceneOf(scene), request);
}

// Everything that acts on the light and is not an imperfection must cancel: distortion, the emitter
// 45 mm beside the lens, three frequencies, three steps. What is left is float: 2e-7 of a turn at
// each frequency, 0.11 m per radian.
TEST(EndToEnd, AnIdealKinectMeasuresASlantedWallExactly) {
  const SensorModel model = idealKinect();
  const Light light = direct(model, kWall, 0.0, 1);
  const RangeImage image = model.expose(light, {}, 1, 0).range;
  double worst_m = 0.0;
  int valid = 0;
  for (std::size_t i = 0; i < image.range_m.size(); ++i) {
    if (std::isnan(image.range_m[i])) continue;
    ++valid;
    worst_m =
        std::max(worst_m, static_cast<double>(std::abs(image.range_m[i] - light.truth.range_m[i])));
  }
  EXPECT_GT(valid, 200'000);  // the lamp's cone does not reach into the corners
  EXPECT_LT(worst_m, 5e-6);
}

TEST(EndToEnd, APresetsWallIsOffByItsWiggleAndItsDroppedSquareOnly) {
  const SensorModel model = SensorModel::parse(withoutFilters(), "preset")->withEffects({});
  const Light light = direct(model, kWall, 0.0, 1);
  const RangeImage image = model.expose(light, {}, 1, 0).range;
  for (std::size_t i = 0; i < image.range_m.size(); ++i) {
    if (std::isnan(image.range_m[i])) continue;
    const double range_m = static_cast<double>(light.truth.range_m[i]);
    const double off_m = static_cast<double>(image.range_m[i]) - range_m;
    // L² / 4r, up to 10 % more off the axis; the clipped sine 1.4 mm with all harmonics, 1.9 with
    // seven
    ASSERT_LT(std::abs(off_m - 0.045 * 0.045 / (4.0 * range_m)), 2.0e-3 + 1e-4) << i;
  }
}

TEST(EndToEnd, FootprintsMakeFlyingPixelsAndCentralRaysDoNot) {
  const SensorModel model = idealKinect();
  const auto flyingPixels = [&](double pixel_extent, int samples) {
    constexpr int kRow = 212;
    const Light light = direct(model, kBoxBeforeWall, pixel_extent, samples, kRow);
    const RangeImage image = model.expose(light, {}, 1, 0, 0, kRow).range;
    int count = 0;
    for (int x = 100; x < 400; ++x) {
      const double z_m = static_cast<double>(image.range_m(x, 0) * model.rays().z(x, kRow));
      if (std::abs(z_m - 1.5) > 0.005 && std::abs(z_m - 3.0) > 0.005 && !std::isnan(z_m)) ++count;
    }
    return count;
  };
  EXPECT_EQ(flyingPixels(0.0, 1), 0);
  EXPECT_GE(flyingPixels(1.0, 64), 1);
}

}  // namespace
}  // namespace toftwin::sim
