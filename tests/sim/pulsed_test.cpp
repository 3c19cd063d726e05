// SPDX-License-Identifier: Apache-2.0
// Pulsed cameras: gates, their decoding, and the error that a left-over charge makes.
#include "sim/sensor/pulse.h"

#include <gmock/gmock.h>

#include <cmath>

#include "sim/decode/decode_steps.h"
#include "tests/sim/camera_testing.h"

namespace toftwin::sim {
namespace {

constexpr double kHalfWay_m = 0.5 * kSpeedOfLight_m_per_s * 20e-9;  // c T / 2 of 20 ns: 3 m

/// Light that a tracer would give for these returns.
Light gatedLight(const Pulse& pulse, const std::vector<Way>& ways, double ambient = 0.0) {
  Light light;
  light.steady = Image<float>{1, 1};
  light.ambient = Image<float>{1, 1, static_cast<float>(ambient)};
  light.phasors.emplace_back(1, 1);
  for (const Way& way : ways) {
    const Duration delay = 2.0 * way.range_m / kSpeedOfLight_m_per_s * second;
    light.phasors[0](0, 0) += std::complex<float>(std::complex<double>{
        way.radiance * pulse.gateShare(0, delay), way.radiance * pulse.gateShare(1, delay)});
    light.steady(0, 0) += static_cast<float>(way.radiance);
  }
  return light;
}

DecodeSettings settingsOf(const Pulse& pulse) {
  DecodeSettings settings{.algorithm = DecodeSettings::Algorithm::Pulsed};
  settings.pulse_scheme = pulse.scheme;
  settings.pulse_width = pulse.width;
  return settings;
}

double rangeOf(const Pulse& pulse, const std::vector<Way>& ways, double ambient = 0.0) {
  return static_cast<double>(
      decode(collectGates(gatedLight(pulse, ways, ambient), pulse, 1e5, 0.5), settingsOf(pulse))
          .range_m(0, 0));
}

constexpr PulseScheme kSchemes[] = {PulseScheme::ShortLong, PulseScheme::TwoGate};

TEST(Pulsed, OneReturnIsExactWithAndWithoutAmbient) {
  for (PulseScheme scheme : kSchemes) {
    const Pulse pulse{.scheme = scheme, .width = 20_ns};
    for (double range_m : {0.1, 0.7, 1.5, 2.9}) {
      EXPECT_NEAR(rangeOf(pulse, {{1.0, range_m}}), range_m, 3e-6);
      EXPECT_NEAR(rangeOf(pulse, {{1.0, range_m}}, 0.7), range_m, 6e-6);
    }
  }
}

// Ambient charge a per gate that is not taken off pulls to the middle of the range.
TEST(Pulsed, WithoutAnAmbientGateAmbientPullsToTheMiddle) {
  const Pulse pulse{.scheme = PulseScheme::TwoGate, .width = 20_ns, .has_ambient_gate = false};
  for (double range_m : {0.4, 1.2, 2.6}) {
    const double second_gate = range_m / kHalfWay_m, ambient = 0.3 * 0.5;  // open half of the time
    EXPECT_NEAR(rangeOf(pulse, {{1.0, range_m}}, 0.3),
                kHalfWay_m * (second_gate + ambient) / (1.0 + 2.0 * ambient), 5e-6);
  }
}

TEST(Pulsed, TwoReturnsAreTheirChargeWeightedMean) {
  for (PulseScheme scheme : kSchemes) {
    const Pulse pulse{.scheme = scheme, .width = 20_ns};
    EXPECT_NEAR(rangeOf(pulse, {{3.0, 0.8}, {1.0, 2.4}}), (3.0 * 0.8 + 2.4) / 4.0, 3e-6);
  }
}

// A charge b left in each gate: d̂ − d = −d b / (L + b), L = K ρ / d². Reference values for b = 30
// and K = 20,000: −46 mm at 2.5 m for ρ = 0.5, −214 mm for ρ = 0.1 (given to a millimetre).
double errorOfOffset(double albedo, double range_m, double electrons = 30.0) {
  const Pulse pulse{.scheme = PulseScheme::ShortLong, .width = 30_ns, .has_ambient_gate = false};
  constexpr double kElectrons = 20'000.0;
  Samples samples = collectGates(gatedLight(pulse, {{albedo / (range_m * range_m), range_m}}),
                                 pulse, kElectrons, 0.01);
  for (Image<float>& gate : samples.electrons) gate(0, 0) += static_cast<float>(electrons);
  return static_cast<double>(decode(samples, settingsOf(pulse)).range_m(0, 0)) - range_m;
}

TEST(Pulsed, ALeftOverChargeReadsTooNearAndMoreOnDarkSurfaces) {
  EXPECT_NEAR(1e3 * errorOfOffset(0.5, 2.5), -46.0, 0.6);
  EXPECT_NEAR(1e3 * errorOfOffset(0.1, 2.5), -214.0, 0.6);
  // −b d³ / (K ρ) where b is small
  EXPECT_NEAR(errorOfOffset(0.5, 1.0) / (-30.0 / (20'000.0 * 0.5)), 1.0, 0.01);
}

TEST(Pulsed, ThatErrorGrowsSteadilyAndIsNeverCyclic) {
  double before = 0.0;
  for (double range_m = 0.3; range_m < 4.4; range_m += 0.05) {
    const double error = errorOfOffset(0.5, range_m);
    EXPECT_LT(error, before) << range_m;
    before = error;
  }
}

TEST(Pulsed, AnEmitterThatRisesSlowlyMakesKneesThatTheTableTakesOff) {
  const Pulse pulse{.scheme = PulseScheme::TwoGate, .width = 20_ns, .rise = 3_ns};
  const std::vector<double> table = rangesOfRatios(pulse, 49);
  EXPECT_TRUE(std::is_sorted(table.begin(), table.end()));
  DecodeSettings calibrated = settingsOf(pulse);
  calibrated.pulse_ranges_m = table;
  double worst_straight = 0.0, worst_calibrated = 0.0;
  for (double range_m = 0.2; range_m < 2.7; range_m += 0.01) {
    const Samples samples = collectGates(gatedLight(pulse, {{1.0, range_m}}), pulse, 1e5, 0.01);
    const auto errorWith = [&](const DecodeSettings& settings) {
      return std::abs(static_cast<double>(decode(samples, settings).range_m(0, 0)) - range_m);
    };
    worst_straight = std::max(worst_straight, errorWith(settingsOf(pulse)));
    worst_calibrated = std::max(worst_calibrated, errorWith(calibrated));
  }
  // Late by at most r: c r / 2 = 0.45 m. The table's chords are off by h²/8 · |d²range/dratio²|, h
  // = 1/48, with d²t/dratio² = T² e^(−x) / (r (1 − e^(−x))³), x = (T − τ)/r, the most at the far
  // end, 2.7 m: 88.8 m, so 4.8 mm.
  EXPECT_GT(worst_straight, 0.2);
  EXPECT_LT(worst_straight, 0.45);
  EXPECT_LT(worst_calibrated, 4.9e-3);
}

TEST(Pulsed, PulseIsWholeAndTheLowPassDelaysIt) {
  const Pulse pulse{.width = 20_ns, .rise = 3_ns};
  EXPECT_EQ(pulse.arrivedBefore(0_ns), 0.0);
  EXPECT_NEAR(pulse.arrivedBefore(200_ns), 1.0, 1e-12);
  EXPECT_NEAR(pulse.arrivedBefore(20.000001_ns), pulse.arrivedBefore(20_ns), 1e-6);
  double mean_ns = 0.0;  // ∫ (1 − P) dt
  for (int i = 0; i < 20'000; ++i)
    mean_ns += 0.01 * (1.0 - pulse.arrivedBefore((i + 0.5) * 0.01 * nanosecond));
  EXPECT_NEAR(mean_ns, 10.0 + 3.0, 1e-4);
}

/// The factory's table goes along where a model is changed: with it gone, a slow rise would be 0.2 m off.
TEST(Pulsed, AChangedModelReadsByTheSameTable) {
  const SensorModel model = modelOf(
      "[lens]\nwidth = 40\nheight = 30\nfx = 40\nfy = 40\ncx = 20\ncy = 15\n[[emitter]]\npower_w = 1\n"
      "[pulse]\nwidth_ns = 20\nrise_ns = 3\nscheme = \"two_gate\"\n[sampling]\nfactory_calibration = "
      "\"waveform\"\n"
      "[decoder]\nalgorithm = \"pulsed\"\n");
  const auto scene = Scene::parse(
      "[[material]]\nname = 'w'\n[[object]]\nshape = 'rectangle'\nsize_m = [40, 40, 0]\n"
      "position_m = [0, 0, 1.5]\nmaterial = 'w'\n",
      "scene.toml");
  TraceRequest request = model.traceRequest();
  request.max_surfaces = 1, request.samples_per_pixel = 1, request.pixel_extent = 0.0;
  const Light light = trace(*scene, request);
  const auto plain = model.expose(light, {}, 1, 0);
  const auto exposed_more = model.with("exposure_us", model.exposures({}).front().duration.in(microsecond));
  ASSERT_TRUE(exposed_more) << exposed_more.error().message;
  for (const SensorModel& changed : {model.withEffects({}), model.withLens(model.camera()), *exposed_more}) {
    const auto again = changed.expose(light, {}, 1, 0);
    for (std::size_t i = 0; i < light.truth.range_m.size(); ++i) {
      ASSERT_NEAR(again.range.range_m[i], light.truth.range_m[i], 4.9e-3) << i << ": a chord of the table";
      ASSERT_EQ(again.range.range_m[i], plain.range.range_m[i]) << i;
    }
  }
}

// Through the tracer: each path's charge is a function of its length, so a flat wall is as exact as
// its range.
TEST(Pulsed, ATracedWallIsExact) {
  for (const char* scheme : {"short_long", "two_gate"}) {
    const SensorModel model = modelOf(std::string{"[lens]\nwidth = 40\nheight = 30\nfx = 40\nfy = "
                                                  "40\ncx = 20\ncy = 15\n[[emitter]]\npower_w = 1\n"
                                                  "[pulse]\nwidth_ns = 20\nscheme = \""} +
                                      scheme + "\"\n[decoder]\nalgorithm = \"pulsed\"\n");
    const auto scene = Scene::parse(
        "[[material]]\nname = 'w'\n[[object]]\nshape = 'rectangle'\nsize_m = [40, 40, "
        "0]\nposition_m = [0, 0, 1.5]\n"
        "euler_deg = [0, 20, 0]\nmaterial = 'w'\n",
        "scene.toml");
    TraceRequest request = model.traceRequest();
    request.max_surfaces = 1;
    request.pixel_extent = 0.0;
    request.samples_per_pixel = 1;
    const Light light = trace(*scene, request);
    const auto exposed = model.expose(light, {}, 1, 0);
    for (std::size_t i = 0; i < light.truth.range_m.size(); ++i) {
      if (light.truth.range_m[i] > 2.9F) continue;
      // Float's rounding of two charges of about 1: 3 m · 2⁻²³ · some
      ASSERT_NEAR(exposed.range.range_m[i], light.truth.range_m[i], 3e-6) << i;
    }
  }
}

TEST(Pulsed, CameraFilesThatCannotBeAreErrors) {
  using testing::HasSubstr;
  EXPECT_THAT(errorOf("[[emitter]]\n[pulse]\n"), HasSubstr("needs algorithm = \"pulsed\""));
  EXPECT_THAT(errorOf("[[emitter]]\n[[modulation]]\n[decoder]\nalgorithm = 'pulsed'\n"),
              HasSubstr("there is no [pulse]"));
  EXPECT_THAT(errorOf("[[emitter]]\n[[modulation]]\n[pulse]\n[decoder]\nalgorithm = 'pulsed'\n"),
              HasSubstr("pulsed or it is not"));
  EXPECT_EQ(errorOf("[[emitter]]\n[pulse]\n[decoder]\nalgorithm = 'pulsed'\n"), "");
}

TEST(Pulsed, ExposesItsGatesOneAfterTheOther) {
  const SensorModel model = *SensorModel::preset("generic_pulsed");
  const auto exposures = model.exposures({0});
  ASSERT_EQ(exposures.size(), 3u);
  EXPECT_EQ(exposures[2].start.ns, 2 * 5'000'000);
  EXPECT_EQ(exposures[0].modulation, 0_MHz);
  EXPECT_FALSE(model.hasPhasors());
  EXPECT_EQ(model.with("exposure_us", 2000.0)->exposures({0})[1].start.ns, 3'000'000);
}

}  // namespace
}  // namespace toftwin::sim
