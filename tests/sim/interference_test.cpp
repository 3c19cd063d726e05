// SPDX-License-Identifier: Apache-2.0
// Light of other cameras: charges against integrals over time of both signals as they run.
#include "sim/sensor/interference.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "sim/sensor/sensor_model.h"
#include "tests/tracer/tracing.h"

namespace toftwin::sim::testing {
namespace {

constexpr double kWay_m = 7.3;       // from the other emitter to the pinhole
constexpr double kRadiance = 0.05;   // mean
constexpr double kGain = 1e6;        // electrons per radiance in one exposure

/// Mean 1, centred on t = 0. `rise_turns`: the sine is behind a low pass of that time constant, in turns.
double signal(const std::string& shape, double duty, double turns, double rise_turns = 0.0) {
  turns -= std::round(turns);
  if (shape == "sine")
    return 1.0 + std::cos(2.0 * kPi * turns - std::atan(2.0 * kPi * rise_turns)) / std::hypot(1.0, 2.0 * kPi * rise_turns);
  return std::abs(turns) < 0.5 * duty ? 1.0 / duty : 0.0;
}

struct Case {
  std::string what;
  double own_mhz, other_mhz;
  std::string emitted, demodulated;  ///< of the camera
  int harmonics;
  std::string other;  ///< the other light's waveform, as its key says
  double other_duty = 0.5;
  double tolerance;  ///< of the largest difference of taps
  double other_rise_ns = 0.0;  ///< of a sine
};

SensorModel cameraOf(const Case& of) {
  auto model = SensorModel::parse(fmt::format(R"(model = "test"
[lens]
width = 2
height = 1
fx = 2
fy = 2
cx = 0.5
cy = 0
[[emitter]]
power_w = 1
[[modulation]]
frequency_mhz = {}
contrast = 0.4
exposure_us = 2000
emitted = "{}"
demodulated = "{}"
[sampling]
steps = 4
taps = 2
gap_us = 3
harmonics = {}
[pixel]
electrons_per_radiance_s = {}
# It changes nothing, but before effects on the light act, harmonics go that nobody wants.
[[effect]]
type = "vignetting"
exponent = 0
)", of.own_mhz, of.emitted, of.demodulated, of.harmonics, kGain / 2e-3), "camera.toml");
  if (!model) throw std::runtime_error{model.error().message};
  return *std::move(model);
}

ForeignEmitterSpec emitterOf(const Case& of) {
  const auto scene = sceneOf(fmt::format("[[material]]\nname = 'm'\n[[object]]\nshape = 'sphere'\nradius_m = 1\nmaterial = 'm'\n"
                                         "[[foreign_emitter]]\nfrequency_mhz = {}\nphase_deg = 25\nmodulation = 0.9\n"
                                         "emitted = '{}'\n",
                                         of.other_mhz, of.other) +
                             (of.other == "square" ? fmt::format("emitted_duty = {}\n", of.other_duty) : "") +
                             (of.other_rise_ns > 0.0 ? fmt::format("rise_ns = {}\n", of.other_rise_ns) : ""));
  return scene.foreignEmitters().front();
}

/// What the other light adds to tap 0 less tap 1 of a raw exposure, one place in each of many intervals, so spread that edges of square waves lie
/// anywhere between two.
double integral(const Case& of, const Exposure& exposure, int step) {
  constexpr int kIntervals = 8'000'000;
  const double start = 1e-9 * static_cast<double>(exposure.start.ns), duration = exposure.duration.in(second);
  const double own = 1e6 * of.own_mhz, other = 1e6 * of.other_mhz;
  const std::string shape = of.other == "like_camera" ? of.emitted : of.other;
  double sum = 0.0;
  for (int i = 0; i < kIntervals; ++i) {
    const double place = std::fmod(0.6180339887498949 * i, 1.0);
    const double t = start + duration * (i + place) / kIntervals;
    const double turns = other * (t - kWay_m / kSpeedOfLight_m_per_s) + 25.0 / 360.0;
    const double light = 0.9 * signal(shape, of.other_duty, turns, 1e-9 * of.other_rise_ns * other) + 0.1;
    sum += light * (signal(of.demodulated, 0.5, own * t - step / 4.0) - 1.0);
  }
  const auto fundamental = [](const std::string& wave) { return wave == "sine" ? 0.5 : 2.0 / kPi; };
  const double per_reference = 0.4 / (2.0 * fundamental(of.emitted) * fundamental(of.demodulated));
  return kGain * kRadiance * per_reference * sum / kIntervals;
}

/// The same with Interference and the camera's own pixels.
std::vector<double> collected(const Case& of, const SensorModel& model, const std::vector<Exposure>& exposures) {
  const auto interferences = model.interferences({emitterOf(of)});
  const TraceRequest request = interferences.front().request(model.traceRequest());
  Light other;
  other.frequencies = request.frequencies;
  other.steady = {2, 1, static_cast<float>(kRadiance)};
  for (const Frequency f : request.frequencies)
    other.phasors.push_back({2, 1, std::complex<float>{std::polar(kRadiance, -wavenumber(f) * kWay_m)}});
  Light own;
  own.frequencies = model.traceRequest().frequencies;
  own.harmonics = of.harmonics;
  // Of harmonics that its emitter lacks the camera's own phasor must not matter.
  own.phasors.assign(static_cast<std::size_t>(of.harmonics), {2, 1, {0.01f, -0.02f}});
  own.steady = own.ambient = {2, 1, 0.03f};
  Moment moment;
  moment.exposures = exposures;
  const Samples alone = model.collect(own, moment, 1, 0);
  std::vector<double> added;
  for (std::size_t k = 0; k < exposures.size(); ++k) {
    Light both = own;
    interferences.front().addTo(both, other, exposures[k], 0_us);
    const Samples samples = model.collect(both, moment, 1, 0);
    const auto of_tap = [&](std::size_t tap) {
      return static_cast<double>(samples.electrons[2 * k + tap](1, 0)) - static_cast<double>(alone.electrons[2 * k + tap](1, 0));
    };
    EXPECT_NEAR(of_tap(0) + of_tap(1), kGain * kRadiance, 0.02) << of.what << ": its mean is charge";
    added.push_back(of_tap(0) - of_tap(1));
  }
  return added;
}

/// What is left out of the sums is below the tolerance: harmonics above those of the camera, where both signals have them.
TEST(Interference, IsTheIntegralOfBothSignals) {
  for (const Case& of : {
           Case{"two sines", 80.0, 80.00013, "sine", "sine", 1, "sine", 0.5, 1e-5},
           Case{"the fifth of a square wave", 80.0, 16.000025, "sine", "sine", 1, "square", 0.5, 2e-4},
           Case{"the second and fifth of a short pulse's", 41.0, 20.49998, "sine", "sine", 1, "square", 0.22, 3e-4},
           Case{"a sine on the third of a reference, which the own light lacks", 20.0, 60.00009, "sine", "square", 3,
                "sine", 0.5, 2e-4},
           Case{"two of a kind, of square waves", 20.0, 20.0001, "square", "square", 15, "like_camera", 0.5, 2e-3},
           Case{"a slow sine", 80.0, 80.00013, "sine", "sine", 1, "sine", 0.5, 1e-5, 3.0},
           Case{"too far apart to be seen", 20.0, 27.0, "sine", "sine", 1, "sine", 0.5, 1.0},
       }) {
    const SensorModel model = cameraOf(of);
    const auto exposures = model.exposures(DeviceTime{123'456'000});
    const auto added = collected(of, model, exposures);
    double most = 0.0;
    std::vector<double> exact;
    for (std::size_t k = 0; k < exposures.size(); ++k) {
      exact.push_back(integral(of, exposures[k], static_cast<int>(k)));
      most = std::max(most, std::abs(exact.back()));
    }
    const bool is_seen = of.what != "too far apart to be seen";
    EXPECT_EQ(most > 500.0, is_seen) << of.what << ": too little to judge by, or too much";
    for (std::size_t k = 0; k < exposures.size(); ++k)
      EXPECT_NEAR(added[k], exact[k], of.tolerance * most + 0.02) << of.what << ", step " << k;
  }
}

/// Two of them add up, also where the camera's own light has no such harmonic.
TEST(Interference, OfTwoOthersIsTheirSum) {
  const Case of{"both", 20.0, 60.00009, "sine", "square", 3, "sine", 0.5, 0.0};
  const SensorModel model = cameraOf(of);
  const Interference interference = model.interferences({emitterOf(of)}).front();
  const TraceRequest request = interference.request(model.traceRequest());
  const Exposure exposure = model.exposures(DeviceTime{123'456'000}).front();
  Light other;
  other.frequencies = request.frequencies;
  other.steady = {2, 1, 0.05f};
  other.phasors.assign(request.frequencies.size(), {2, 1, {0.03f, 0.01f}});
  const auto mixed = [&](int times) {
    Light light;
    light.frequencies = {20_MHz};
    light.harmonics = 3;
    light.phasors.assign(3, {2, 1});
    light.steady = light.ambient = {2, 1};
    for (int i = 0; i < times; ++i) interference.addTo(light, other, exposure, 0_us);
    return light;
  };
  const Light once = mixed(1), twice = mixed(2);
  EXPECT_GT(std::abs(once.phasor(0, 3)(0, 0)), 1e-3f);
  EXPECT_LT(std::abs(twice.phasor(0, 3)(0, 0) - 2.0f * once.phasor(0, 3)(0, 0)), 1e-8f);
  EXPECT_EQ(twice.error.content, once.error.content);
  EXPECT_THROW(Interference(emitterOf(of), {{.frequency = 0_MHz}}, 1), std::invalid_argument);
}

/// Its own way and direction, whatever the camera's pose; no light is traced for beats that leave nothing.
TEST(Interference, TracesTheOtherLightAlone) {
  const Scene scene = sceneOf(
      "[[material]]\nname = 'm'\nalbedo = 0.7\n[[object]]\nshape = 'rectangle'\nsize_m = [9, 9, 0]\n"
      "position_m = [0, 0, 2]\nmaterial = 'm'\n[[foreign_emitter]]\nposition_m = [1.5, 0, 0]\nisotropic = "
      "true\npower_w = 6.283185307\nfrequency_mhz = 16.0025\nemitted = 'square'\n");
  const Interference interference{scene.foreignEmitters().front(),
                                  {{.frequency = 80_MHz}, {.frequency = 77_MHz}},
                                  1};
  TraceRequest own = requestFor(1, 1, 1.0, {80_MHz, 77_MHz});
  own.world_from_camera = rotation<World, Camera>({0, 0, 1}, 0.7);
  const TraceRequest request = interference.request(own);
  ASSERT_EQ(request.frequencies.size(), 1u) << "the fifth is near 80 MHz; even ones a square wave has not";
  EXPECT_NEAR(request.frequencies[0].in(megahertz), 80.0125, 1e-9);
  const Light light = trace(scene, request);
  const double d = 2.5, radiance = 0.7 / kPi * 0.5 * (2.0 / d) / (d * d);
  EXPECT_LT(std::abs(phasorAt(light, 0, 0, 0) - std::polar(radiance, -wavenumber(request.frequencies[0]) * (2.0 + d))),
            4e-7);
}

/// Each row by its own time.
TEST(Interference, RollsWithTheShutter) {
  const Case of{"rolls", 80.0, 80.0001, "sine", "sine", 1, "sine", 0.5, 0.0};
  const SensorModel model = cameraOf(of);
  const Interference interference = model.interferences({emitterOf(of)}).front();
  Light light, other;
  light.frequencies = {80_MHz};
  light.phasors = {{1, 3}};
  light.ambient = {1, 3};
  other.frequencies = {80.0001_MHz};
  other.phasors = {{1, 3, {0.1f, 0.0f}}};
  other.steady = {1, 3, 0.1f};
  interference.addTo(light, other, {DeviceTime{0}, 2000_us, 80_MHz}, 2500_us);
  const std::complex<float> first = light.phasors[0](0, 0);
  EXPECT_LT(std::abs(light.phasors[0](0, 1) - first * std::complex<float>{0.0f, 1.0f}), 1e-6f) << "a quarter of a beat";
  EXPECT_LT(std::abs(light.phasors[0](0, 2) + first), 1e-6f);
}

}  // namespace
}  // namespace toftwin::sim::testing
