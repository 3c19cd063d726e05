// SPDX-License-Identifier: Apache-2.0
// What each effect does, through the whole sensor.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/sim/camera_testing.h"

namespace toftwin::sim {
namespace {

// A background pixel at 2 m gets 5 % of its own amplitude from a foreground at 0.5 m.
TEST(LensScatter, PullsByTheWorkedExample) {
  const struct {
    Frequency f;
    double error_mm;
  } table[] = {{16_MHz, -61.30}, {80_MHz, 13.94}, {120_MHz, -9.32}};
  for (const auto& row : table) {
    std::string camera =
        plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'lens_scatter'\nveil = 0.05\nhalo = 0\n");
    camera.replace(camera.find("frequency_mhz = 80"), 18,
                   "frequency_mhz = " + std::to_string(row.f.in(megahertz)));
    const SensorModel model = modelOf(camera);
    // One foreground pixel so bright that the even veil of 5 % of it over the image of n pixels is
    // 5 % of what a background pixel keeps; the background's own veil has the background's phase
    // and no effect on it.
    const double n = 400.0 * 250.0, others = n - 1.0;
    const double bright = 0.05 * (0.95 + 0.05 * others / n) / (0.05 / n);
    Light light = syntheticLight(400, 250, {row.f}, 1, [&](int x, int y) {
      return std::vector<Way>{x == 7 && y == 9 ? Way{bright, 0.5} : Way{1.0, 2.0}};
    });
    const double seen_m =
        static_cast<double>(model.expose(light, {}, 1, 0).range.range_m(200, 100));
    const double period_m = unambiguousRange(row.f).in(metre);
    EXPECT_NEAR(1e3 * std::remainder(seen_m - 2.0, period_m), row.error_mm, 0.01)
        << row.f.in(megahertz) << " MHz";
  }
}

TEST(LensScatter, OfAnEvenImageKeepsAllLightInTheMiddle) {
  const LensScatter lens{.veil = 0.1, .halo = 0.2, .halo_radius = 5.0};
  const Light light = syntheticLight(
      81, 81, {20_MHz}, 1,
      [](int, int) {
        return std::vector<Way>{{1.0, 1.5}};
      },
      0.5);
  const Light after = lens.apply(light, {Moment{}, cameraOfSize(81, 81)}, Random{1, 1, 1});
  EXPECT_NEAR(std::abs(after.phasor(0, 1)(40, 40)), 1.0, 1e-5);
  EXPECT_NEAR(after.steady(40, 40), 1.0, 1e-5);
  EXPECT_NEAR(after.ambient(40, 40), 0.5, 1e-5);
  EXPECT_NEAR(after.steady(0, 40), 0.7 + 0.1 + 0.2 * 0.5,
              0.02);  // half of the halo comes from outside: dark
}

TEST(LensScatter, HaloOfOnePixelIsTheGaussian) {
  const LensScatter lens{.veil = 0.0, .halo = 0.5, .halo_radius = 3.0};
  const Light light = syntheticLight(61, 61, {20_MHz}, 1, [](int x, int y) {
    return std::vector<Way>{{x == 30 && y == 30 ? 1.0 : 0.0, 1.0}};
  });
  const Light after = lens.apply(light, {Moment{}, cameraOfSize(61, 61)}, Random{1, 1, 1});
  for (int x : {31, 33, 36}) {
    // The sampled Gaussian cut at four standard deviations misses 6e-5 of its sum per axis.
    const double expected = 0.5 * std::exp(-0.5 * std::pow((x - 30) / 3.0, 2)) / (2.0 * kPi * 9.0);
    EXPECT_NEAR(after.steady(x, 30), expected, 3e-4 * expected) << x;
  }
}

TEST(WarmUp, EndsAtZeroAndStartsAtTheSumOfBothParts) {
  const SensorModel model =
      modelOf(plainCamera(4, 2, 0.5,
                          "[[effect]]\ntype = 'warm_up'\nfast_mm = 3\nfast_time_s = 60\n"
                          "slow_mm = 5\nslow_time_s = 600\n"));
  const Light light = evenLight(model, 1.0, 0.9);
  const auto errorAt = [&](std::optional<Duration> since) {
    Moment moment;
    moment.since_power_on = since;
    return 1e3 * (rangeStatistics(model.expose(light, moment, 1, 0).range).mean - 0.9);
  };
  EXPECT_NEAR(errorAt(0_s), -8.0, 2e-4);
  EXPECT_NEAR(errorAt(60_s), -3.0 * std::exp(-1.0) - 5.0 * std::exp(-0.1), 2e-4);
  EXPECT_NEAR(errorAt(100'000_s), 0.0, 2e-4);
  EXPECT_NEAR(errorAt(std::nullopt), 0.0, 2e-4);
}

TEST(Saturation, FlagsAndInvalidatesThePixelThatIsTooBright) {
  const SensorModel model = modelOf(
      plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'saturation'\nfull_well_electrons = 6000\n"));
  const auto dark =
      model.expose(evenLight(model, 0.7, 0.9), {}, 1, 0).range;  // largest tap 0.75 · 7000
  const auto bright = model.expose(evenLight(model, 0.9, 0.9), {}, 1, 0).range;  // 0.75 · 9000
  EXPECT_EQ(dark.flags(3, 3), 0);
  EXPECT_EQ(bright.flags(3, 3), static_cast<unsigned>(PixelFlag::Saturated) |
                                    static_cast<unsigned>(PixelFlag::Invalid));
  EXPECT_TRUE(std::isnan(bright.range_m(3, 3)));
}

TEST(Quantisation, TakesTheNearestStep) {
  Samples samples;
  samples.steps = 3;
  samples.electrons.assign(3, {2, 1});
  const float values[] = {14.9F, 15.1F, -4.0F, -6.0F, 0.0F, 1e6F};
  for (std::size_t i = 0; i < 6; ++i) samples.electrons[i / 2][i % 2] = values[i];
  samples =
      Quantisation{.step_electrons = 10.0}.apply(samples, {Moment{}, cameraOfSize(2, 1)}, Random{1, 1, 1});
  const float steps[] = {10.0F, 20.0F, 0.0F, -10.0F, 0.0F, 1e6F};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(samples.electrons[i / 2][i % 2], steps[i]) << i;
}

/// Against 40,000 draws of noise, at 20 charges for each width of it: five standard errors, 3e-5 false alarms in all.
TEST(Quantisation, HasTheMeanOverNoiseOfItsSteps) {
  constexpr int kDraws = 40'000;
  constexpr double kStep = 10.0;
  std::mt19937 random{20264};
  std::normal_distribution<double> normal;
  for (const double sigma : {0.15, 0.3, 0.6}) {  // in steps
    for (int i = 0; i < 20; ++i) {
      const double charge = 700.0 + 0.93 * i;
      Samples drawn{.frequencies = {20_MHz}, .steps = 1, .electrons = {Image<float>{kDraws, 1}}};
      for (float& one : drawn.electrons[0].pixels()) one = static_cast<float>(charge + kStep * sigma * normal(random));
      drawn = Quantisation{.step_electrons = kStep}.apply(drawn, {Moment{}, cameraOfSize(kDraws, 1)}, Random{1, 1, 1});
      double sum = 0.0, squares = 0.0;
      for (const float one : drawn.electrons[0].pixels()) {
        const double off = static_cast<double>(one) - charge;
        sum += off, squares += off * off;
      }
      const double of_draws = sum / kDraws, error = std::sqrt((squares / kDraws - of_draws * of_draws) / kDraws);
      // Half of it by each kind of noise.
      const double half = 0.5 * kStep * kStep * sigma * sigma;
      const Samples mean = Quantisation{.step_electrons = kStep, .mean_over = {half / charge, half}}.apply(
          {.frequencies = {20_MHz}, .steps = 1, .electrons = {Image<float>{1, 1, static_cast<float>(charge)}}},
          {Moment{}, cameraOfSize(1, 1)}, Random{1, 1, 1});
      EXPECT_NEAR(static_cast<double>(mean.electrons[0](0, 0)) - charge, of_draws, 5.0 * error + 1e-3)
          << sigma << ' ' << charge;
    }
  }
}

TEST(AmbientLight, AddsTheMomentsIlluminanceAndNothingWithoutIt) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'ambient_light'\n"));
  const Light light = evenLight(model, 1.0, 0.9);  // albedo 0.5
  Moment moment;
  const double without = static_cast<double>(model.expose(light, moment, 1, 0).range.ambient(1, 1));
  moment.ambient = 10_klx;
  const double with = static_cast<double>(model.expose(light, moment, 1, 0).range.ambient(1, 1));
  EXPECT_NEAR(with - without, 1e4 * 0.5 * 0.27 * 10.0 / kPi, 0.01);
}

TEST(FixedPatternPhase, HasItsSpreadIsConstantAndDiffersBetweenDevices) {
  const std::string effect =
      "[[effect]]\ntype = 'fixed_pattern_phase'\nsigma_rad = 0.03\ndevice = ";
  const SensorModel one = modelOf(plainCamera(4, 2, 0.5, effect + "1\n")),
                    two = modelOf(plainCamera(4, 2, 0.5, effect + "2\n"));
  const Light light = evenLight(one, 1.0, 0.9);
  const auto image = one.expose(light, {}, 1, 0).range;
  const double sigma = rangeStatistics(image).sigma * kSigmaToPhase80MHz;
  EXPECT_NEAR(sigma, 0.03, 0.01 * 0.03);  // 4.5 standard errors
  EXPECT_EQ(one.expose(light, {}, 99, 7).range.phasors, image.phasors);
  EXPECT_NE(two.expose(light, {}, 1, 0).range.phasors, image.phasors);
}

// The turn itself: its cosine and sine against the library's, harmonic by harmonic.
TEST(FixedPatternPhase, TurnsEachHarmonicByItsMultipleOfThePattern) {
  const FixedPatternPhase effect{.sigma = 1.1_rad, .device = 5};
  const Light light = syntheticLight(
      300, 4, {20_MHz, 60_MHz}, 3, [](int, int) { return std::vector<Way>{{1.0, 0.0}}; });
  const Light seen = effect.apply(light, {Moment{}, cameraOfSize(300, 4)}, Random{1, 1, 1});
  const Random pattern{5, 0, effectKey("fixed_pattern_phase", 0)};
  for (std::size_t f : {0U, 1U}) {
    for (std::uint32_t i = 0; i < 1200; ++i) {
      const double angle = -1.1 * static_cast<double>(pattern.draw(f).normal(i));
      for (int n : {1, 3}) {
        const std::complex<double> turned{seen.phasor(f, n)[i]};
        // The angle is a float of up to 6: 5e-7 of rounding, three times that for the third.
        EXPECT_LT(std::abs(turned - std::polar(1.0, n * angle)), 1e-6 * n) << i;
      }
    }
  }
}

}  // namespace
}  // namespace toftwin::sim
