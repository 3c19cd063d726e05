// SPDX-License-Identifier: Apache-2.0
// What emission and demodulation do wrong, as errors of the phase over one turn: closed forms.
#include <gmock/gmock.h>

#include <cmath>

#include "tests/sim/phase_rig.h"

namespace toftwin::sim {
namespace {

// Phasors and samples are floats: 6e-8 of 3000 electrons against an amplitude of 1000.
constexpr double kEmissionRounding = 4e-6;

std::string harmonics(const std::string& keys) {
  return "[[effect]]\ntype = 'harmonics'\nthird = 0\n" + keys + "\n";
}
std::string third(double h) {
  return "[[effect]]\ntype = 'harmonics'\nthird = " + std::to_string(h) + "\n";
}

// p = A (e^(−iφ) + h e^(3iφ)): the error atan(h sin 4φ / (1 + h cos 4φ)) is the series
// Σ −(−h)^j/j sin 4jφ, at most asin h.
TEST(Harmonics, ThirdGivesFourStepsAFourCycleErrorOfItsOwnSizeAtAnyAmplitude) {
  for (double amplitude : {1000.0, 250.0}) {
    const Turn turn = turnOf({.amplitude = amplitude, .effects = third(0.05)});
    EXPECT_NEAR(turn.errorCycles(4), 0.05, 4.0 * kEmissionRounding) << amplitude;
    EXPECT_NEAR(turn.errorCycles(8), 0.05 * 0.05 / 2.0, 4.0 * kEmissionRounding);
    EXPECT_NEAR(turn.peak(), std::asin(0.05), 1e-4);  // the grid of one degree misses the top by 1e-3
    EXPECT_LT(turn.otherCycles({4, 8, 12}), 4.0 * kEmissionRounding);
    EXPECT_LT(turn.closureCycles(0) + turn.closureCycles(2),
              4.0 * kEmissionRounding);  // the free channel is blind
  }
}

TEST(Harmonics, ThreeStepsDoNotSeeTheThirdButTheSecond) {
  EXPECT_LT(turnOf({.steps = 3, .effects = third(0.05)}).peak(), kEmissionRounding * 4.0);
  const Turn turn = turnOf({.steps = 3, .effects = harmonics("second = 0.02")});
  EXPECT_NEAR(turn.errorCycles(3), 0.02, kEmissionRounding);
  EXPECT_LT(turn.otherCycles({3, 6}), kEmissionRounding);
}

TEST(Harmonics, EvenOnesShowInTheClosureOfFourStepsAlone) {
  const Turn turn = turnOf({.effects = harmonics("second = 0.02")});
  EXPECT_NEAR(turn.closureCycles(2), 4.0 * 0.02, 4.0 * kEmissionRounding);
  EXPECT_LT(turn.peak(), kEmissionRounding * 2.0);
}

TEST(Harmonics, ThatAreNotTracedAreAnErrorThatSaysSo) {
  const std::string camera = plainCamera(4, 2, 0.5, third(0.05));
  EXPECT_THAT(errorOf(camera), testing::HasSubstr("set sampling.harmonics to at least that"));
}

constexpr auto kSquare = "emitted = 'square'\ndemodulated = 'square'\n";
Moment warm(double illumination_c, double sensor_c = 25.0) {
  Moment moment;
  moment.temperatures = {{"sensor", sensor_c * celsius}, {"illumination", illumination_c * celsius}};
  return moment;
}

void expectSame(const Turn& a, const Turn& b, double tolerance) {
  for (std::size_t i = 0; i < a.error_rad.size(); ++i)
    ASSERT_NEAR(std::remainder(a.error_rad[i] - b.error_rad[i], 2.0 * kPi), 0.0, tolerance) << i;
}

TEST(RiseDrift, MakesTheCameraThatTheFileWouldDescribeWithTheOtherRiseTime) {
  const std::string modulation = std::string{kSquare} + "rise_ns = ";
  const Turn drifted =
      turnOf({.effects = "[[effect]]\ntype = 'rise_drift'\nrise_ns = 2\nper_degree_ns = 0.1\n",
              .modulation = modulation + "2\n",
              .harmonics = 31,
              .moment = warm(45.0)});
  const Turn filed = turnOf({.modulation = modulation + "4\n", .harmonics = 31});
  expectSame(drifted, filed, 1e-5);
  // 45.76 mm at 30 MHz (wiggling_test), up to the harmonics above the 31st, 1e-3 of the fundamental.
  const double mm_per_rad = 1e3 * unambiguousRange(30_MHz).in(metre) / (2.0 * kPi);
  EXPECT_NEAR(drifted.peak() * mm_per_rad, 45.76, 1e-3 * mm_per_rad);
  // The file's waveform is scaled to its contrast; the drift loses modulation as the low pass does.
  const double omega_ns = 2.0 * kPi * 0.030;
  const double lost = std::hypot(1.0, 2.0 * omega_ns) / std::hypot(1.0, 4.0 * omega_ns);
  for (std::size_t i = 0; i < 360; i += 30)
    EXPECT_NEAR(drifted.amplitude[i] / filed.amplitude[i], lost, 1e-5);
}

TEST(RiseDrift, AndDutyDriftDoNothingWhereTheTemperatureIsUnknown) {
  const Turn turn = turnOf({.effects = "[[effect]]\ntype = 'rise_drift'\n[[effect]]\ntype = "
                                       "'duty_drift'\n[[effect]]\ntype = 'thermal_delay'\n"});
  EXPECT_LT(turn.peak() + std::abs(turn.mean()), kEmissionRounding);
}

// By numeric correlation in time: duty 1/3 kills the third harmonic and leaves the fifth and seventh.
TEST(DutyDrift, OfASquareWaveChangesTheWigglingAsTheTableSays) {
  const auto drift = [](double to) {
    return "[[effect]]\ntype = 'duty_drift'\nfalling_edge = 0.5\nper_degree = " +
           std::to_string((to - 0.5) / 5.0) + "\n";
  };
  const double cut = 1.5e-3;  // harmonics above the 31st, relative to the fundamental at these duties
  const Turn third = turnOf(
      {.effects = drift(1.0 / 3.0), .modulation = kSquare, .harmonics = 31, .moment = warm(30.0)});
  EXPECT_NEAR(third.peak(), 0.057, cut);
  EXPECT_NEAR(third.errorCycles(4), 0.039, cut);
  EXPECT_NEAR(third.errorCycles(8), 0.019, cut);
  const Turn quarter = turnOf(
      {.effects = drift(0.25), .modulation = kSquare, .harmonics = 31, .moment = warm(30.0)});
  EXPECT_NEAR(quarter.peak(), 0.071, cut);
  const Turn three_steps = turnOf({.steps = 3,
                                   .effects = drift(0.25),
                                   .modulation = kSquare,
                                   .harmonics = 31,
                                   .moment = warm(30.0)});
  EXPECT_NEAR(three_steps.peak(), 0.068, cut);
  EXPECT_NEAR(three_steps.errorCycles(6), 0.060, cut);
  expectSame(quarter,
             turnOf({.modulation = std::string{kSquare} + "emitted_duty = 0.25\n", .harmonics = 31}),
             1e-5);
}

// The middle of the pulse moves by half of what its falling edge does: ψ = 2π · ½ ΔD.
TEST(DutyDrift, AtTheFallingEdgeDelaysTheLight) {
  const Turn turn = turnOf({.effects = "[[effect]]\ntype = 'duty_drift'\nper_degree = 0.001\n",
                            .modulation = kSquare,
                            .harmonics = 31,
                            .moment = warm(35.0)});
  EXPECT_NEAR(turn.mean(), kPi * 0.01, 1e-5);
}

TEST(ThermalDelay, IsTheSameInMillimetresAtEveryFrequencyAndShiftsTheWiggling) {
  const std::string effect = "[[effect]]\ntype = 'thermal_delay'\n";
  for (double mhz : {16.0, 30.0, 120.0}) {
    const PhaseRig rig{.frequency_mhz = mhz, .effects = effect, .moment = warm(45.0, 35.0)};
    const double mm_per_rad = 1e3 * unambiguousRange(mhz * megahertz).in(metre) / (2.0 * kPi);
    EXPECT_NEAR(turnOf(rig).mean() * mm_per_rad, 0.5 * 20.0 + 0.2 * 10.0, 1e-2) << mhz;
  }
  // 50 K · κ = 1/8 of the period: four cycles of wiggling are then upside down.
  const double eighth_mm = 1e3 * unambiguousRange(30_MHz).in(metre) / 8.0;
  const Turn shifted =
      turnOf({.effects = effect + "per_degree_mm = " + std::to_string(eighth_mm / 50.0) +
                         "\nper_sensor_degree_mm = 0\n",
              .modulation = kSquare,
              .harmonics = 31,
              .moment = warm(75.0)});
  const Turn straight = turnOf({.modulation = kSquare, .harmonics = 31});
  for (std::size_t i = 0; i < 360; i += 7)
    EXPECT_NEAR(shifted.error_rad[i] - kPi / 4.0, straight.error_rad[(i + 45) % 360], 1e-5) << i;
}

// libfreenect2's decoder gives each frequency's unwrapped cycles the same weight: 18.737 m / 27 per
// cycle of phase, 110.44 mm per radian with the true speed of light.
TEST(FrequencyOffset, OfAKinectV2IsTheSameRangeErrorAtEachFrequency) {
  std::string text = *SensorModel::presetText("kinect_v2");
  // The clipped sine at 16 MHz wiggles, and an offset shifts that, too.
  text.replace(text.find("\"clipped_sine\""), 14, "\"sine\"");
  const SensorModel model = modelOf(text);
  const TraceRequest request = model.traceRequest();
  const Light light = syntheticLight(3, 1, request.frequencies, request.harmonics, [](int, int) {
    return std::vector<Way>{{0.5, 2.3}};
  });
  const auto rangeWith = [&](FrequencyOffset offset) {
    // In the lens' middle column, where the baseline's correction is a constant.
    return 1e3 * static_cast<double>(model.withEffects({offset})
                                         .expose(light, {}, 1, 0, 254, 205)
                                         .range.range_m(1, 0));
  };
  const double right = rangeWith(FrequencyOffset::none());
  const double per_rad = 1e3 * kSpeedOfLight_m_per_s / (2.0 * 8e6) / 27.0 / (2.0 * kPi);
  EXPECT_NEAR(per_rad, 110.44, 0.01);
  EXPECT_NEAR(rangeWith({.first = 0.01_rad}) - right, 0.01 * per_rad, 2e-3);
  EXPECT_NEAR(rangeWith({.first = 0_rad, .second = 0.01_rad}) - right, 0.01 * per_rad, 2e-3);
  EXPECT_NEAR(rangeWith({.first = 0_rad, .third = 0.01_rad}) - right, 0.01 * per_rad, 2e-3);
}

TEST(StepPhase, OfOneDegreeIsAnOffsetATwoCycleErrorAndAClosureOfOneCycle) {
  const Turn turn = turnOf({.effects = "[[effect]]\ntype = 'step_phase'\nerror_rad = 0.0174533\n"});
  const double quarter = 0.0174533 / 4.0;  // to first order; the second is ψ²/16 = 2e-5
  EXPECT_NEAR(turn.mean(), -quarter, 2e-5);  // a late reference makes the light look early
  EXPECT_NEAR(turn.errorCycles(2), quarter, 2e-5);
  EXPECT_LT(turn.otherCycles({2, 4}), 2e-5);
  EXPECT_NEAR(turn.closureCycles(1), 0.0174533, 4.0 * kEmissionRounding);
}

}  // namespace
}  // namespace toftwin::sim
