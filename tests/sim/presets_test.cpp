// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>

#include "tests/sim/camera_testing.h"

namespace toftwin::sim {
namespace {

using testing::HasSubstr;

TEST(Presets, AllLoadAndSayWhatTheyAre) {
  for (const std::string& name : SensorModel::presetNames()) {
    const auto model = SensorModel::preset(name);
    ASSERT_TRUE(model) << model.error().message;
    EXPECT_FALSE(model->model().empty());
    EXPECT_FALSE(model->effectNames().empty());
    EXPECT_EQ(model->camera().calibration_id.size(), 32u);
  }
  EXPECT_THAT(SensorModel::presetNames(),
              testing::IsSupersetOf({"kinect_v2", "o3d303", "generic_cw"}));
  EXPECT_THAT(SensorModel::preset("kinect_v1").error().message, HasSubstr("kinect_v2"));
}

TEST(Presets, KinectV2TakesItsNineRawExposuresInOrderWithinAFrame) {
  const auto exposures = SensorModel::preset("kinect_v2")->exposures({1000});
  ASSERT_EQ(exposures.size(), 9u);
  EXPECT_EQ(exposures[0].start.ns, 1000);
  EXPECT_EQ(exposures[1].start.ns, 1000 + 3'300'000);
  EXPECT_EQ(exposures[2].modulation, 80_MHz);
  EXPECT_EQ(exposures[3].modulation, 16_MHz);
  EXPECT_EQ(exposures[8].modulation, 120_MHz);
  EXPECT_LT(exposures[8].start.ns, 33'333'333);
}

/// A wall of albedo 0.8 square to the axis, on the axis, without multipath: the light of a point
/// lamp at the lens.
Statistics whitePaper(const SensorModel& model, double distance_m) {
  const EmitterSpec emitter = model.traceRequest().emitters[0];
  const double intensity = emitter.power_w * (emitter.lobe_exponent + 1.0) / (2.0 * kPi);
  const double radiance = 0.8 / kPi * intensity / (distance_m * distance_m);
  const double baseline_m = norm(emitter.position_m);
  const TraceRequest request = model.traceRequest();
  // A small image in the middle, every pixel at the same range: L² + r² − 2 r L u is the square of
  // the way there.
  constexpr int kMargin = 1;  // the Kinect's filter leaves the border as it is
  const int left = static_cast<int>(model.camera().cx) - 51,
            top = static_cast<int>(model.camera().cy) - 51;
  const Light light =
      syntheticLight(102, 102, request.frequencies, request.harmonics, [&](int x, int y) {
        const double u = static_cast<double>(model.rays().x(left + x, top + y));
        const double there_m = std::sqrt(distance_m * distance_m + baseline_m * baseline_m -
                                         2.0 * distance_m * baseline_m * u);
        return std::vector<Way>{{radiance, (distance_m + there_m) / 2.0}};
      });
  return rangeStatistics(model.expose(light, {}, 1, 0, left, top).range, kMargin);
}

// σ² = a² + (b d)² + (c d²)²: what the presets' photon budgets were fitted to. 10,000 pixels,
// nine of which share their noise: standard error of a deviation 2.1 % where there is no floor of
// independent noise; the budget's numbers are rounded to 0.3 %, and the converter's steps add 2 % at 4 m.
TEST(Presets, KinectV2HasTheNoiseItWasFittedTo) {
  const SensorModel model = *SensorModel::preset("kinect_v2");
  for (double d : {0.6, 1.0, 2.0, 4.0}) {
    const double expected_mm =
        std::sqrt(std::pow(1.148, 2) + std::pow(0.1745 * d, 2) + std::pow(0.1537 * d * d, 2));
    const Statistics seen = whitePaper(model, d);
    EXPECT_NEAR(1e3 * seen.sigma, expected_mm, 0.065 * expected_mm) << d << " m";
    EXPECT_EQ(seen.valid, 1.0) << d << " m";
    // The dropped square of its baseline, and the wiggle of the clipped 16 MHz (1.4 mm).
    EXPECT_NEAR(1e3 * (seen.mean - d), 1e3 * 0.045 * 0.045 / (4.0 * d), 1.5) << d << " m";
  }
}

TEST(Presets, O3d303HasTheNoiseItWasFittedTo) {
  // The square wave stretches and squeezes the phase by up to dφ̂/dφ = 1 ± 0.36, and taking the cyclic
  // error off undoes that for the noise, too; what is left of it varies with the range. Here: root mean
  // square over 16 ranges of one 4-cycle around d.
  const SensorModel model = *SensorModel::preset("o3d303");
  for (double d : {1.0, 2.0, 3.0}) {
    double variance = 0.0;
    for (int i = 0; i < 16; ++i) {
      const double range_m = d + (i / 16.0 - 0.5) * 4.9965 / 4.0;
      const Statistics seen = whitePaper(model, range_m);
      const auto fit = [](double r) {
        return std::pow(3.05, 2) + std::pow(4.78 * r, 2) + std::pow(3.87 * r * r, 2);
      };
      variance += std::pow(1e3 * seen.sigma, 2) / fit(range_m) / 16.0;
    }
    EXPECT_NEAR(std::sqrt(variance), 1.0, 0.15) << d << " m";
  }
}

/// The largest error of a single return over 3.5 m, without noise.
double peakError(const SensorModel& model) {
  const Light light =
      syntheticLight(350, 1, {30_MHz}, model.traceRequest().harmonics, [](int x, int) {
        return std::vector<Way>{{1e-3, 0.5 + 0.01 * x}};
      });
  const auto image = model.expose(light, {}, 1, 0).range;
  double peak_m = 0.0;
  for (int x = 0; x < 350; ++x)
    peak_m = std::max(peak_m, std::abs(static_cast<double>(image.range_m(x, 0)) - 0.5 - 0.01 * x));
  return peak_m;
}

/// The preset as if its factory had left the cyclic error in.
SensorModel o3d303WithCyclicError() {
  std::ifstream file{TOFTWIN_SOURCE_DIR "/sim/cameras/o3d303.toml"};
  std::string text{std::istreambuf_iterator<char>{file}, {}};
  const std::string_view with = "factory_calibration = \"waveform\"";
  text.replace(text.find(with), with.size(), "factory_calibration = \"delay\"");
  return *SensorModel::parse(text, "o3d303.toml");
}

TEST(Presets, O3d303WouldWiggleAsASquareWaveDoes) {
  const double peak_m = peakError(o3d303WithCyclicError().withEffects({}));
  // Seven of the triangle's harmonics; the eighth that leaks is the 9th: (1/81 + 1/121) of 795 mm
  // at most missing.
  EXPECT_NEAR(1e3 * peak_m, 56.55, 795.2 * (1.0 / 81.0 + 1.0 / 121.0) / 2.0);
}

TEST(Presets, O3d303TakesItsCyclicErrorOff) {
  // What is left is the table's linear interpolation, h²/8 · max |d²φ/dφ̂²| with h = 2π/4096. φ̂ has a 4-cycle of
  // 0.072 rad and, of the 7th harmonic, an 8-cycle of 1/49; φ̂' is 2/π at least:
  // (16 · 0.072 + 64 / 49) / (2/π)³ = 9.5, so 2.8e-6 rad of 795 mm. Float's rounding of phase and range: 1 µm.
  const double interpolation_rad = std::pow(2.0 * std::numbers::pi / 4096.0, 2) / 8.0 * 9.5;
  EXPECT_LT(1e3 * peakError(SensorModel::preset("o3d303")->withEffects({})), 795.2 * interpolation_rad + 0.001);
}

TEST(Presets, O3d303LeavesTheErrorOfTwoReturnsIn) {
  const SensorModel model = SensorModel::preset("o3d303")->withEffects({});
  const Light light = syntheticLight(1, 1, {30_MHz}, model.traceRequest().harmonics, [](int, int) {
    return std::vector<Way>{{1e-3, 1.0}, {0.3e-3, 2.0}};
  });
  EXPECT_GT(model.expose(light, {}, 1, 0).range.range_m(0, 0), 1.05F);
}

}  // namespace
}  // namespace toftwin::sim
