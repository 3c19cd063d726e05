// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor/sensor_model.h"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "sim/sensor/frame_assembly.h"
#include "tests/sim/synthetic_light.h"

namespace toftwin::sim {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
constexpr double kPi = std::numbers::pi;

/// A camera whose pixels collect 1e4 electrons per raw exposure at radiance 1; `more` is appended.
std::string plainCamera(int steps, int taps, double contrast, const std::string& more = {}) {
  return "[lens]\nwidth = 400\nheight = 250\nfx = 300\nfy = 300\ncx = 200\ncy = 125\n[[emitter]]\n"
         "[[modulation]]\nfrequency_mhz = 80\nexposure_us = 1000\ncontrast = " + std::to_string(contrast) +
         "\n[sampling]\nsteps = " + std::to_string(steps) + "\ntaps = " + std::to_string(taps) +
         "\n[pixel]\nelectrons_per_radiance_s = 1e7\n" + more;
}
constexpr auto kShotNoise = "[[effect]]\ntype = 'shot_noise'\n";

SensorModel modelOf(const std::string& toml) {
  auto model = SensorModel::parse(toml, "camera.toml");
  if (!model) throw std::runtime_error{model.error().message};
  return *std::move(model);
}
std::string errorOf(const std::string& toml) {
  const auto model = SensorModel::parse(toml, "camera.toml");
  return model ? "" : model.error().message;
}

Light evenLight(const SensorModel& model, double radiance, double range_m, double ambient = 0.0) {
  const TraceRequest request = model.traceRequest();
  Light light = syntheticLight(model.camera().width, model.camera().height, request.frequencies, request.harmonics,
                               [&](int, int) { return std::vector<Way>{{radiance, range_m}}; }, ambient);
  return light;
}

struct Statistics {
  double mean = 0.0, sigma = 0.0, valid = 0.0;
};
Statistics rangeStatistics(const RangeImage& image) {
  Statistics s;
  double sum = 0.0, squares = 0.0, n = 0.0;
  for (float range_m : image.range_m.pixels()) {
    if (std::isnan(range_m)) continue;
    sum += static_cast<double>(range_m);
    squares += static_cast<double>(range_m) * static_cast<double>(range_m);
    n += 1.0;
  }
  s.mean = sum / n;
  s.sigma = std::sqrt(squares / n - s.mean * s.mean);
  s.valid = n / static_cast<double>(image.range_m.size());
  return s;
}
constexpr double kSigmaToPhase80MHz = 4.0 * kPi * 80e6 / kSpeedOfLight_m_per_s;

// σ_φ = √(2 (N_e + N_a) / N) / (m N_e). 100,000 pixels: a standard deviation is known to 0.22 %; 1 % is 4.5 of that.
TEST(ShotNoise, GivesThePhaseNoiseOfTheFormula) {
  const struct { int steps; double ambient, sigma_rad; } table[] = {
      {4, 0.0, 0.009428}, {4, 3.0, 0.018856}, {3, 0.0, 0.010887}, {5, 0.0, 0.008433}};
  for (const auto& row : table) {
    const SensorModel model = modelOf(plainCamera(row.steps, 2, 0.75, kShotNoise));
    const auto exposed = model.expose(evenLight(model, 1.0, 0.9, row.ambient), {}, 1, 0);
    const double sigma = rangeStatistics(exposed.range).sigma * kSigmaToPhase80MHz;
    EXPECT_NEAR(sigma, std::sqrt(2.0 * (1e4 + 1e4 * row.ambient) / row.steps) / (0.75 * 1e4), 0.01 * sigma);
    EXPECT_NEAR(sigma, row.sigma_rad, 0.01 * row.sigma_rad) << row.steps << " steps, ambient " << row.ambient;
  }
}

// Read noise of σ in each of two taps adds 2 σ² to the variance of a difference.
TEST(ReadNoise, AddsToThePhaseNoiseAsTheFormulaSays) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.75, std::string{kShotNoise} +
                                                               "[[effect]]\ntype = 'read_noise'\nsigma_electrons = 80\n"));
  const double sigma = rangeStatistics(model.expose(evenLight(model, 1.0, 0.9), {}, 2, 0).range).sigma * kSigmaToPhase80MHz;
  const double expected = std::sqrt(2.0 * (1e4 + 2.0 * 80.0 * 80.0) / 4.0) / (0.75 * 1e4);
  EXPECT_NEAR(sigma, expected, 0.01 * expected);
}

// Three single-ended samples: σ swings by ±10 % three times per turn, for var Sₖ = B + A cos(φ − θₖ). From the
// propagated variance (2/N)² Σ var Sₖ sin²(φ − θₖ) / A² = (2/N)(B − A cos 3φ / 2) / A²; at the contrast of 0.4 ±10 %.
TEST(ShotNoise, OfThreeSingleEndedSamplesSwingsThreeTimesPerTurn) {
  const double contrast = 0.4;
  const SensorModel model = modelOf(plainCamera(3, 1, contrast, kShotNoise));
  const double mean = 0.5e4, amplitude = contrast * mean;
  for (double phase : {0.0, kPi / 6.0, kPi / 3.0, 2.0 * kPi / 3.0, 1.3}) {
    const double range_m = (phase + 2.0 * kPi) / kSigmaToPhase80MHz;
    const double sigma = rangeStatistics(model.expose(evenLight(model, 1.0, range_m), {}, 3, 0).range).sigma;
    if (phase == 0.0) continue;  // wraps at range 0
    const double expected = std::sqrt(2.0 / 3.0 * (mean - amplitude * std::cos(3.0 * phase) / 2.0)) / amplitude;
    EXPECT_NEAR(sigma * kSigmaToPhase80MHz, expected, 0.01 * expected) << phase;
  }
}

TEST(Noise, IsKeyedByFrameSeedAndPixelAndNotByThreadsOrRegion) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.75, kShotNoise));
  const Light light = evenLight(model, 1.0, 0.9);
  const auto first = model.expose(light, {}, 1, 5).range;
  EXPECT_EQ(model.expose(light, {}, 1, 5).range.phasors, first.phasors);
  EXPECT_NE(model.expose(light, {}, 1, 6).range.phasors, first.phasors);
  EXPECT_NE(model.expose(light, {}, 2, 5).range.phasors, first.phasors);
  const Light part = syntheticLight(50, 20, {80_MHz}, 1, [](int, int) { return std::vector<Way>{{1.0, 0.9}}; });
  const auto region = model.expose(part, {}, 1, 5, 37, 91).range;
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 50; ++x) ASSERT_EQ(region.range_m(x, y), first.range_m(37 + x, 91 + y)) << x << ", " << y;
  }
}

TEST(Noise, OfTwoFramesIsIndependentAtEveryPixel) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.75, kShotNoise));
  const Light light = evenLight(model, 1.0, 0.9);
  const auto a = model.expose(light, {}, 1, 0).range.range_m, b = model.expose(light, {}, 1, 1).range.range_m;
  double product = 0.0, square = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    product += (static_cast<double>(a[i]) - 0.9) * (static_cast<double>(b[i]) - 0.9);
    square += std::pow(static_cast<double>(a[i]) - 0.9, 2);
  }
  EXPECT_LT(std::abs(product / square), 5.0 / std::sqrt(100'000.0));  // 6e-7 false alarms
}

// A background pixel at 2 m gets 5 % of its own amplitude from a foreground at 0.5 m.
TEST(LensScatter, PullsByTheWorkedExample) {
  const struct { Frequency f; double error_mm; } table[] = {{16_MHz, -61.30}, {80_MHz, 13.94}, {120_MHz, -9.32}};
  for (const auto& row : table) {
    std::string camera = plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'lens_scatter'\nveil = 0.05\nhalo = 0\n");
    camera.replace(camera.find("frequency_mhz = 80"), 18, "frequency_mhz = " + std::to_string(row.f.in(megahertz)));
    const SensorModel model = modelOf(camera);
    // One foreground pixel so bright that the even veil of 5 % of it over the image of n pixels is 5 % of what a
    // background pixel keeps; the background's own veil has the background's phase and no effect on it.
    const double n = 400.0 * 250.0, others = n - 1.0;
    const double bright = 0.05 * (0.95 + 0.05 * others / n) / (0.05 / n);
    Light light = syntheticLight(400, 250, {row.f}, 1, [&](int x, int y) {
      return std::vector<Way>{x == 7 && y == 9 ? Way{bright, 0.5} : Way{1.0, 2.0}};
    });
    const double seen_m = static_cast<double>(model.expose(light, {}, 1, 0).range.range_m(200, 100));
    const double period_m = unambiguousRange(row.f).in(metre);
    EXPECT_NEAR(1e3 * std::remainder(seen_m - 2.0, period_m), row.error_mm, 0.01) << row.f.in(megahertz) << " MHz";
  }
}

TEST(LensScatter, OfAnEvenImageKeepsAllLightInTheMiddle) {
  const LensScatter lens{.veil = 0.1, .halo = 0.2, .halo_radius = 5.0};
  const Light light = syntheticLight(81, 81, {20_MHz}, 1, [](int, int) { return std::vector<Way>{{1.0, 1.5}}; }, 0.5);
  const Light after = lens.apply(light, {Moment{}, 0, 0, 81}, Random{1, 1, 1});
  EXPECT_NEAR(std::abs(after.phasor(0, 1)(40, 40)), 1.0, 1e-5);
  EXPECT_NEAR(after.steady(40, 40), 1.0, 1e-5);
  EXPECT_NEAR(after.ambient(40, 40), 0.5, 1e-5);
  EXPECT_NEAR(after.steady(0, 40), 0.7 + 0.1 + 0.2 * 0.5, 0.02);  // half of the halo comes from outside: dark
}

TEST(LensScatter, HaloOfOnePixelIsTheGaussian) {
  const LensScatter lens{.veil = 0.0, .halo = 0.5, .halo_radius = 3.0};
  const Light light = syntheticLight(61, 61, {20_MHz}, 1, [](int x, int y) {
    return std::vector<Way>{{x == 30 && y == 30 ? 1.0 : 0.0, 1.0}};
  });
  const Light after = lens.apply(light, {Moment{}, 0, 0, 61}, Random{1, 1, 1});
  for (int x : {31, 33, 36}) {
    // The sampled Gaussian cut at four standard deviations misses 6e-5 of its sum per axis.
    const double expected = 0.5 * std::exp(-0.5 * std::pow((x - 30) / 3.0, 2)) / (2.0 * kPi * 9.0);
    EXPECT_NEAR(after.steady(x, 30), expected, 3e-4 * expected) << x;
  }
}

TEST(WarmUp, EndsAtZeroAndStartsAtTheSumOfBothParts) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'warm_up'\nfast_mm = 3\nfast_time_s = 60\n"
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
  const SensorModel model = modelOf(plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'saturation'\nfull_well_electrons = 6000\n"));
  const auto dark = model.expose(evenLight(model, 0.7, 0.9), {}, 1, 0).range;   // largest tap 0.75 · 7000
  const auto bright = model.expose(evenLight(model, 0.9, 0.9), {}, 1, 0).range;  // 0.75 · 9000
  EXPECT_EQ(dark.flags(3, 3), 0);
  EXPECT_EQ(bright.flags(3, 3), static_cast<unsigned>(PixelFlag::Saturated) | static_cast<unsigned>(PixelFlag::Invalid));
  EXPECT_TRUE(std::isnan(bright.range_m(3, 3)));
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
  const std::string effect = "[[effect]]\ntype = 'fixed_pattern_phase'\nsigma_rad = 0.03\ndevice = ";
  const SensorModel one = modelOf(plainCamera(4, 2, 0.5, effect + "1\n")), two = modelOf(plainCamera(4, 2, 0.5, effect + "2\n"));
  const Light light = evenLight(one, 1.0, 0.9);
  const auto image = one.expose(light, {}, 1, 0).range;
  const double sigma = rangeStatistics(image).sigma * kSigmaToPhase80MHz;
  EXPECT_NEAR(sigma, 0.03, 0.01 * 0.03);  // 4.5 standard errors
  EXPECT_EQ(one.expose(light, {}, 99, 7).range.phasors, image.phasors);
  EXPECT_NE(two.expose(light, {}, 1, 0).range.phasors, image.phasors);
}

TEST(CameraFile, ErrorsNameFileLineKeyBoundAndUnit) {
  EXPECT_THAT(errorOf("[lens]\nwidth = 0\n"), HasSubstr("camera.toml:2: width"));
  EXPECT_THAT(errorOf(plainCamera(2, 2, 0.5)), HasSubstr("steps = 2"));
  EXPECT_THAT(errorOf(plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'warmup'\n")),
              testing::AllOf(HasSubstr("\"warmup\" is no effect"), HasSubstr("warm_up")));
  EXPECT_THAT(errorOf(plainCamera(4, 2, 0.5, "[[effect]]\nveil = 0.1\n")), HasSubstr("type is missing"));
  EXPECT_THAT(errorOf(plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'lens_scatter'\nveil = 0.7\n")),
              HasSubstr("veil = 0.7 is out of bounds: it must be 0 to 0.5"));
  EXPECT_THAT(errorOf(plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'delay'\noffset_m = 1\n")), HasSubstr("unknown key \"offset_m\""));
  EXPECT_THAT(errorOf("model = 'x'\n"), testing::AllOf(HasSubstr("no [[emitter]]"), HasSubstr("no [[modulation]]")));
  EXPECT_THAT(errorOf("[[emitter]]\naxis = [0, 0, 0]\n[[modulation]]\n"), HasSubstr("axis of length 0"));
  EXPECT_THAT(errorOf("[[emitter]]\n[[modulation]]\n[decoder]\nnearest_m = 3\nfarthest_m = 2\n"), HasSubstr("every range would be invalid"));
}

TEST(CameraFile, PhysicsThatCannotBeIsAnError) {
  const std::string start = "[[emitter]]\n[sampling]\nharmonics = 31\n[[modulation]]\nfrequency_mhz = 30\n";
  EXPECT_THAT(errorOf(start + "contrast = 0.95\nemitted = 'square'\ndemodulated = 'square'\n"),
              HasSubstr("negative charge"));
  EXPECT_EQ(errorOf(start + "contrast = 0.8\nemitted = 'square'\ndemodulated = 'square'\n"), "");
  EXPECT_THAT(errorOf("[[emitter]]\n[[modulation]]\nfrequency_mhz = 80\n[[modulation]]\nfrequency_mhz = 80.001\n"),
              HasSubstr("ratios of small whole numbers"));
  EXPECT_THAT(errorOf("[[emitter]]\n[[modulation]]\nfrequency_mhz = 80.0001234\n"), HasSubstr("whole kilohertz"));
  EXPECT_THAT(errorOf("[[emitter]]\n[[modulation]]\nfrequency_mhz = 80\n[decoder]\nalgorithm = 'kinect_v2'\n"),
              HasSubstr("10 : 2 : 15"));
}

TEST(CameraFile, TheIdIsTheContentNotTheText) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.5, kShotNoise));
  EXPECT_EQ(model.id().size(), 32u);
  EXPECT_EQ(modelOf("# a comment\n" + plainCamera(4, 2, 0.5, kShotNoise)).id(), model.id());
  EXPECT_NE(modelOf(plainCamera(4, 2, 0.51, kShotNoise)).id(), model.id());
  EXPECT_NE(modelOf(plainCamera(4, 2, 0.5)).id(), model.id());
}

TEST(Parameters, ChangeOneNumberWithinItsBounds) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'delay'\noffset_mm = 1\n"));
  EXPECT_THAT(model.parameterNames(), ElementsAre("exposure_us", "delay.offset_mm"));
  const auto changed = model.with("delay.offset_mm", 12.5);
  ASSERT_TRUE(changed) << changed.error().message;
  EXPECT_NE(changed->id(), model.id());
  const Light light = evenLight(model, 1.0, 0.9);
  EXPECT_NEAR(rangeStatistics(changed->expose(light, {}, 1, 0).range).mean - 0.9, 0.0125, 1e-6);
  EXPECT_EQ(model.with("delay.offset_mm", 1.0)->id(), model.id());
  EXPECT_THAT(model.with("delay.offset_mm", 1e9).error().message, HasSubstr("-10000 to 10000"));
  EXPECT_THAT(model.with("exposure_us", std::nan("")).error().message, HasSubstr("1 to 20000"));
  EXPECT_THAT(model.with("delay.size", 1.0).error().message, HasSubstr("there are: exposure_us, delay.offset_mm"));
}

TEST(Parameters, TwiceTheExposureIsTwiceTheSignal) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.5));
  const Light light = evenLight(model, 1.0, 0.9);
  const double once = static_cast<double>(model.expose(light, {}, 1, 0).range.amplitude(0, 0));
  const double twice = static_cast<double>(model.with("exposure_us", 2000.0)->expose(light, {}, 1, 0).range.amplitude(0, 0));
  EXPECT_NEAR(once, 5000.0, 0.01);  // m N_e
  EXPECT_NEAR(twice, 2.0 * once, 0.01);
}

TEST(Presets, AllLoadAndSayWhatTheyAre) {
  for (const std::string& name : SensorModel::presetNames()) {
    const auto model = SensorModel::preset(name);
    ASSERT_TRUE(model) << model.error().message;
    EXPECT_FALSE(model->model().empty());
    EXPECT_FALSE(model->effectNames().empty());
    EXPECT_EQ(model->camera().calibration_id.size(), 32u);
  }
  EXPECT_THAT(SensorModel::presetNames(), testing::IsSupersetOf({"kinect_v2", "o3d303", "generic_cw"}));
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

/// A wall of albedo 0.8 square to the axis, on the axis, without multipath: the light of a point lamp at the lens.
Statistics whitePaper(const SensorModel& model, double distance_m) {
  const EmitterSpec emitter = model.traceRequest().emitters[0];
  const double intensity = emitter.power_w * (emitter.lobe_exponent + 1.0) / (2.0 * kPi);
  const double radiance = 0.8 / kPi * intensity / (distance_m * distance_m);
  const double baseline_m = norm(emitter.position_m);
  const TraceRequest request = model.traceRequest();
  // A small image in the middle, every pixel at the same range: L² + r² − 2 r L u is the square of the way there.
  const int left = static_cast<int>(model.camera().cx) - 50, top = static_cast<int>(model.camera().cy) - 50;
  const Light light = syntheticLight(100, 100, request.frequencies, request.harmonics, [&](int x, int y) {
    const double u = static_cast<double>(model.rays().x(left + x, top + y));
    const double there_m = std::sqrt(distance_m * distance_m + baseline_m * baseline_m - 2.0 * distance_m * baseline_m * u);
    return std::vector<Way>{{radiance, (distance_m + there_m) / 2.0}};
  });
  return rangeStatistics(model.expose(light, {}, 1, 0, left, top).range);
}

// σ² = a² + (b d)² + (c d²)²: what the presets' photon budgets were fitted to. 10,000 pixels: standard error of a
// deviation 0.7 %; the budget's numbers are rounded to 0.3 %.
TEST(Presets, KinectV2HasTheNoiseItWasFittedTo) {
  const SensorModel model = *SensorModel::preset("kinect_v2");
  for (double d : {0.6, 1.0, 2.0, 4.0}) {
    const double expected_mm = std::sqrt(std::pow(1.148, 2) + std::pow(0.1745 * d, 2) + std::pow(0.1537 * d * d, 2));
    const Statistics seen = whitePaper(model, d);
    EXPECT_NEAR(1e3 * seen.sigma, expected_mm, 0.035 * expected_mm) << d << " m";
    EXPECT_EQ(seen.valid, 1.0) << d << " m";
    // The dropped square of its baseline, and the wiggle of the clipped 16 MHz (1.4 mm).
    EXPECT_NEAR(1e3 * (seen.mean - d), 1e3 * 0.045 * 0.045 / (4.0 * d), 1.5) << d << " m";
  }
}

TEST(Presets, O3d303HasTheNoiseItWasFittedTo) {
  // Its square wave stretches and squeezes the phase by up to dφ̂/dφ = 1 ± 0.36, and the noise with it: look where the
  // wiggle is flat, or at the mean over a turn. Here: root mean square over 16 ranges of one 4-cycle around d.
  const SensorModel model = *SensorModel::preset("o3d303");
  for (double d : {1.0, 2.0, 3.0}) {
    double variance = 0.0;
    for (int i = 0; i < 16; ++i) {
      const double range_m = d + (i / 16.0 - 0.5) * 4.9965 / 4.0;
      const Statistics seen = whitePaper(model, range_m);
      const auto fit = [](double r) { return std::pow(3.05, 2) + std::pow(4.78 * r, 2) + std::pow(3.87 * r * r, 2); };
      variance += std::pow(1e3 * seen.sigma, 2) / fit(range_m) / 16.0;
    }
    EXPECT_NEAR(std::sqrt(variance), 1.0, 0.15) << d << " m";
  }
}

TEST(Presets, O3d303WigglesAsASquareWaveDoes) {
  const SensorModel model = SensorModel::preset("o3d303")->withEffects({});
  const Light light = syntheticLight(350, 1, {30_MHz}, model.traceRequest().harmonics, [](int x, int) {
    return std::vector<Way>{{1e-3, 0.5 + 0.01 * x}};
  });
  const auto image = model.expose(light, {}, 1, 0).range;
  double peak_m = 0.0;
  for (int x = 0; x < 350; ++x) peak_m = std::max(peak_m, std::abs(static_cast<double>(image.range_m(x, 0)) - 0.5 - 0.01 * x));
  // Seven of the triangle's harmonics; the eighth that leaks is the 9th: (1/81 + 1/121) of 795 mm at most missing.
  EXPECT_NEAR(1e3 * peak_m, 56.55, 795.2 * (1.0 / 81.0 + 1.0 / 121.0) / 2.0);
}

TEST(FrameAssembly, GivesThePlanesAskedForInOrder) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.5, "[[effect]]\ntype = 'delay'\noffset_mm = -1200\n"));
  Light light = evenLight(model, 1.0, 1.3);
  light.truth.range_m(0, 0) = 1.3F;
  const PlaneKind kinds[] = {PlaneKind::Samples, PlaneKind::Depth, PlaneKind::Range, PlaneKind::TruthNormal, PlaneKind::Phasors};
  auto exposed = model.expose(light, {}, 1, 0);
  exposed.range.range_m(5, 5) = -0.2F;  // as an effect might make it
  const auto planes = planesOf(model, exposed, light.truth, kinds);
  ASSERT_EQ(planes.size(), 5u);
  EXPECT_EQ(planes[0].channels, 4);
  EXPECT_EQ(planes[3].channels, 3);
  EXPECT_EQ(planes[4].channels, 2);
  for (const Plane& plane : planes) EXPECT_EQ(plane.data.size(), plane.byteSize());
  const auto at = [](const Plane& plane, int x, int y) { return plane.as<float>()[static_cast<std::size_t>(y * 400 + x)]; };
  EXPECT_NEAR(at(planes[2], 200, 125), 0.1, 1e-5);
  EXPECT_FLOAT_EQ(at(planes[1], 30, 40), at(planes[2], 30, 40) * static_cast<float>(rayThroughPixel(model.camera(), 30, 40).v.z));
  EXPECT_TRUE(std::isnan(at(planes[2], 5, 5)));
  EXPECT_TRUE(std::isnan(at(planes[1], 5, 5)));
  EXPECT_NEAR(at(planes[0], 9, 9), exposed.samples.tap(0, 0, 0)(9, 9) - exposed.samples.tap(0, 0, 1)(9, 9), 1e-3);
}

TEST(FrameAssembly, CameraOfARegionSeesTheSameRays) {
  const CameraInfo whole = SensorModel::preset("kinect_v2")->camera();
  const CameraInfo region = cameraOfRegion(whole, 100, 50, 60, 40);
  EXPECT_EQ(rayThroughPixel(region, 7, 9), rayThroughPixel(whole, 107, 59));
}

}  // namespace
}  // namespace toftwin::sim
