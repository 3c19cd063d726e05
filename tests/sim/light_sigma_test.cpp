// SPDX-License-Identifier: Apache-2.0
// What the light says of its own noise, against the closed form and against what many seeds differ by.
#include <gmock/gmock.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "../tracer/tracing.h"
#include "sim/sensor/frame_assembly.h"

namespace toftwin::sim::testing {
namespace {

/// Small numbers of a Light that nobody traced: P = 2 e^{iφ} with variance 0.04 at 20 and 80 MHz.
Light lightOf(float variance) {
  Light light;
  light.frequencies = {20_MHz, 80_MHz};
  for (int f = 0; f < 2; ++f) {
    light.phasors.emplace_back(2, 1, std::polar(2.0f, 1.0f + static_cast<float>(f)));
    light.variance.emplace_back(2, 1, variance);
  }
  light.truth.range_m = Image<float>{2, 1, 1.0f};
  return light;
}

TEST(LightSigma, IsTheNoiseOfThePhaseInMetresAtEachFrequency) {
  Light light = lightOf(0.04f);
  light.phasors[1](1, 0) = {};  // no light comes back
  const Plane plane = lightSigmaOf(light);
  EXPECT_EQ(plane.kind, PlaneKind::LightSigma);
  ASSERT_EQ(plane.channels, 2);
  ASSERT_EQ(plane.data.size(), plane.byteSize());
  const auto sigma_m = plane.as<float>();
  const double at_20_mhz = 0.1 * kSpeedOfLight_m_per_s / (4.0 * kPi * 20e6);
  EXPECT_NEAR(static_cast<double>(sigma_m[0]), at_20_mhz, 1e-6 * at_20_mhz);
  EXPECT_EQ(sigma_m[0], sigma_m[1]);
  EXPECT_NEAR(static_cast<double>(sigma_m[2]), at_20_mhz / 4.0, 1e-6 * at_20_mhz);
  EXPECT_TRUE(std::isnan(sigma_m[3]));
}

TEST(LightSigma, IsNotKnownOfASingleSample) {
  Light light = lightOf(0.0f);
  light.variance.clear();
  const Plane plane = lightSigmaOf(light);
  EXPECT_EQ(plane.channels, 2);
  for (const float sigma_m : plane.as<float>()) EXPECT_TRUE(std::isnan(sigma_m));
}

constexpr auto kCorner = R"(
[[material]]
name = "white"
albedo = 0.8
[[object]]
shape = "rectangle"
size_m = [4, 4, 0]
position_m = [0, 0, 2]
euler_deg = [0, 45, 0]
material = "white"
[[object]]
shape = "rectangle"
size_m = [4, 4, 0]
position_m = [0.6, 0, 1.6]
euler_deg = [0, -45, 0]
material = "white"
)";

/// Squares of deviations, summed over seeds, and what was stated for them.
struct Squares {
  double range = 0.0, both_components = 0.0, stated = 0.0;
};

/// Pixel by pixel over many seeds, at 80 MHz. Deviations are from the mean of all seeds, which takes one
/// degree of freedom.
std::vector<Squares> deviations(Sampler sampler, int seeds) {
  const Scene scene = sceneOf(kCorner);
  TraceRequest request = requestFor(8, 8, 10.0, {20_MHz, 80_MHz});
  request.emitters[0].position_m = {0.05, 0.0, 0.0};
  request.samples_per_pixel = 64;
  request.max_surfaces = 4;
  request.sampler = sampler;
  std::vector<Light> lights;
  for (int seed = 1; seed <= seeds; ++seed) {
    request.seed = static_cast<std::uint64_t>(seed);
    lights.push_back(trace(scene, request));
  }
  const double metre_per_radian = 0.5 / wavenumber(80_MHz), degrees = (seeds - 1.0) / seeds;
  std::vector<Squares> all(64);
  for (std::size_t i = 0; i < all.size(); ++i) {
    Complex mean;
    for (const Light& light : lights) mean += Complex{light.phasors[1][i]} / static_cast<double>(seeds);
    for (const Light& light : lights) {
      const Complex phasor{light.phasors[1][i]};
      const double sigma_m = static_cast<double>(lightSigmaOf(light).as<float>()[64 + i]);
      const Complex apart = (phasor / mean - 1.0) * metre_per_radian;
      all[i].range += std::pow(std::arg(phasor / mean) * metre_per_radian, 2) / degrees;
      all[i].both_components += std::norm(apart) / 2.0 / degrees;
      all[i].stated += sigma_m * sigma_m;
    }
  }
  return all;
}

/// Σ measured / Σ stated over the pixels, and its standard error from how the pixels differ (that of a ratio
/// of sums).
struct Ratio {
  double value, error;
};
Ratio ratioOf(const std::vector<Squares>& pixels, double Squares::*measured) {
  double above = 0.0, below = 0.0, spread = 0.0;
  for (const Squares& pixel : pixels) {
    above += pixel.*measured;
    below += pixel.stated;
  }
  for (const Squares& pixel : pixels) spread += std::pow(pixel.*measured - above / below * pixel.stated, 2);
  return {above / below, std::sqrt(spread) / below};
}

/// Samples of their own are what the stated σ counts on: its square is the mean of those along and across the
/// phasor. Only the one across turns the phase, and it is at most twice their mean.
TEST(LightSigma, OfIndependentSamplesIsWhatSeedsDifferBy) {
  const auto pixels = deviations(Sampler::Plain, 150);
  const Ratio both = ratioOf(pixels, &Squares::both_components), range = ratioOf(pixels, &Squares::range);
  std::printf(
      "squares of what 150 seeds differ by, of those stated: both components %.3f ± %.3f, range %.3f ± "
      "%.3f\n",
      both.value, both.error, range.value, range.error);
  EXPECT_NEAR(both.value, 1.0, 4.0 * both.error);
  EXPECT_LT(range.value, 2.0 + 4.0 * range.error);
}

/// Samples spread evenly over each pixel differ by less than they state.
TEST(LightSigma, OfEvenSamplesIsAnUpperBound) {
  for (const Sampler sampler : {Sampler::Even, Sampler::Shared}) {
    const Ratio both = ratioOf(deviations(sampler, 60), &Squares::both_components);
    std::printf("squares of what 60 seeds differ by, of those stated: %.3f ± %.3f\n", both.value, both.error);
    EXPECT_LT(both.value, 1.0 + 4.0 * both.error);
  }
}

}  // namespace
}  // namespace toftwin::sim::testing
