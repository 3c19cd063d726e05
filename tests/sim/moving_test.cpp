// SPDX-License-Identifier: Apache-2.0
// Motion between raw exposures, from the scene to the range. v speed, Δt from one raw exposure to the next, k
// = 2πf/c.
#include <gtest/gtest.h>

#include <functional>

#include "sim/sensor/collect_moving.h"
#include "sim/tracer/trace.h"
#include "tests/sim/camera_testing.h"

namespace toftwin::sim {
namespace {

constexpr double kSpeed = 1.0;
// 1 ms of exposure and no gap: Δt = 1 ms. Sines on both sides, one tap, four steps.
const std::string kSines = "gap_us = 0\nharmonics = 1\n";

SensorModel sineCamera() {
  std::string toml = plainCamera(4, 1, 0.5, "");
  toml.replace(toml.find("[sampling]\n"), 11,
               "emitted = 'sine'\ndemodulated = 'sine'\n[sampling]\n" + kSines);
  return modelOf(toml);
}

Scene approachingWall(double range_m) {
  auto scene = Scene::parse(
      "[[material]]\nname = 'm'\n[[object]]\nshape = 'rectangle'\nsize_m = [50, 50, 0]\nmaterial = 'm'\n"
      "position_m = [0, 0, " +
          std::to_string(range_m) + "]\nvelocity_m_per_s = [0, 0, 1]\n",
      "s.toml");
  if (!scene) throw std::runtime_error{scene.error().message};
  return *std::move(scene);
}

struct Seen {
  double range_m;     ///< decoded
  double at_first_m;  ///< true range at the middle of the first raw exposure
};

/// One pixel on the axis of what four exposures at their own times give. Even: with the same amplitude at
/// every range, as the closed form has it.
Seen seen(const SensorModel& model, const Scene& scene, std::int64_t start_ns, bool is_even) {
  TraceRequest request = model.traceRequest();
  request.samples_per_pixel = 1;
  request.max_surfaces = 1;
  request.pixel_extent = 0.0;
  request.region_x = 200;
  request.region_y = 125;
  request.region_width = request.region_height = 1;
  Moment moment;
  moment.exposures = model.exposures(DeviceTime{start_ns});
  Light light;
  double first = 0.0;
  auto samples = collectMoving(model, moment, 1, 0, [&](std::size_t e) {
    light = trace(scene.at(middleOf(moment.exposures[e])), request);
    if (is_even) {
      light.phasor(0, 1)(0, 0) /= std::abs(light.phasor(0, 1)(0, 0));
      light.steady(0, 0) = 1.0f;
    }
    if (e == 0) first = static_cast<double>(light.truth.range_m(0, 0));
    return &light;
  });
  const auto exposed = model.readOut(*std::move(samples), moment, 1, 0, 200, 125);
  return {static_cast<double>(exposed.range.range_m(0, 0)), first};
}

/// e = v Δt (1.5 + 0.5 cos 4kd) for a wall that recedes, d at the first raw exposure: 1 to 2 mm at 1 m/s. It
/// is of first order; the second, k (v Δt)², is 2e-3 mm, times a few.
TEST(Motion, BetweenRawExposuresGivesTheClosedForm) {
  const SensorModel model = sineCamera();
  const double k = 2.0 * kPi * 80e6 / kSpeedOfLight_m_per_s, dt = 1e-3;
  double least = 1.0, most = 0.0;
  for (double range = 1.0; range < 1.9; range += 0.05) {
    const Seen at = seen(model, approachingWall(range), 0, true);
    const double error = std::remainder(at.range_m - at.at_first_m, kPi / k);
    EXPECT_NEAR(error, kSpeed * dt * (1.5 + 0.5 * std::cos(4.0 * k * at.at_first_m)), 1e-5) << range;
    least = std::min(least, error);
    most = std::max(most, error);
  }
  EXPECT_NEAR(least, 1.0e-3, 5e-5);
  EXPECT_NEAR(most, 2.0e-3, 5e-5);
}

/// With the amplitude that falls as 1/d², and one tap, which sees the mean light fall, too: the four samples
/// A_k (1/m + cos(2 k d_k − πk/2)) written down and decoded. Up to 1 mm more or less than without.
TEST(Motion, ChangesAmplitudesToo) {
  const SensorModel model = sineCamera();
  const double k = 2.0 * kPi * 80e6 / kSpeedOfLight_m_per_s, dt = 1e-3, contrast = 0.5;
  for (double range = 1.0; range < 1.9; range += 0.1) {
    const Seen at = seen(model, approachingWall(range), 0, false);
    double re = 0.0, im = 0.0;
    for (int step = 0; step < 4; ++step) {
      const double d = at.at_first_m + kSpeed * dt * step, theta = kPi / 2.0 * step;
      const double sample = (1.0 / contrast + std::cos(2.0 * k * d - theta)) / (d * d);
      re += sample * std::cos(theta);
      im += sample * std::sin(theta);
    }
    const double expected = std::atan2(im, re) / (2.0 * k);
    EXPECT_NEAR(std::remainder(at.range_m - expected, kPi / k), 0.0, 3e-6) << range;
  }
}

/// Half a second later the wall is half a metre further.
TEST(Motion, FollowsDeviceTime) {
  const SensorModel model = sineCamera();
  const Scene scene = approachingWall(1.0);
  EXPECT_NEAR(seen(model, scene, 500'000'000, false).at_first_m - seen(model, scene, 0, false).at_first_m,
              0.5, 1e-6);
}

TEST(Motion, GivesUpWhenLightDoes) {
  Moment moment;
  moment.exposures = sineCamera().exposures(DeviceTime{0});
  EXPECT_FALSE(
      collectMoving(sineCamera(), moment, 1, 0, [](std::size_t) -> const Light* { return nullptr; }));
}

}  // namespace
}  // namespace toftwin::sim
