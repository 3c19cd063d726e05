// SPDX-License-Identifier: Apache-2.0
// What pixel and converter do wrong with the charge, as errors of the phase over one turn. Where no
// closed form is given the exact one is to first order, and the tolerance is the second.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "tests/sim/phase_rig.h"

namespace toftwin::sim {
namespace {

// Samples are floats of up to 9000 electrons: 5e-4 against an amplitude of 1000, and rounding is
// the same in each pixel's neighbours now and then.
constexpr double kRounding = 4e-6;

std::string effect(const std::string& type, const std::string& keys) {
  return "[[effect]]\ntype = '" + type + "'\n" + keys + "\n";
}

// 20 electrons on S₀: p gains (2/N) o, so δφ = −atan((o/2A) sin φ …): one cycle of o/2A.
TEST(SampleOffset, IsOneCycleInverselyWithTheAmplitudeAndAConstantClosure) {
  for (const auto& [amplitude, cycles] : {std::pair{1000.0, 0.010}, {250.0, 0.040}}) {
    const Turn turn = turnOf({.amplitude = amplitude, .effects = effect("sample_offset", "")});
    EXPECT_NEAR(turn.errorCycles(1), cycles, 1e-4 * cycles + kRounding) << amplitude;
    EXPECT_LT(turn.otherCycles({1}), 0.51 * cycles * cycles);
    EXPECT_NEAR(turn.closureCycles(0), 20.0 / amplitude, kRounding * 4.0);
    EXPECT_LT(turn.closureCycles(1), kRounding * 4.0);
  }
}

TEST(SampleOffset, IsThereWithoutLight) {
  Samples dark;
  dark.frequencies = {20_MHz};
  dark.steps = 4, dark.taps = 2;
  dark.electrons.assign(8, {3, 2});
  dark = SampleOffset{.step = 2, .tap = 1, .electrons = 7.0}.apply(
      dark, {Moment{}, CameraInfo{}}, Random{1, 1, 1});
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(dark.electrons[i](1, 1), i == 5 ? 7.0F : 0.0F) << i;
}

// 1 % on S₀ = B + A cos φ: δφ = −(γ/2)(B/A + cos φ) sin φ, divided by what the gain adds to the real
// part: one cycle of γB/2A = 0.0150, which grows with B/A, and two of γ/4 − …: 0.0024 at any amplitude.
TEST(SampleGain, IsOneCycleOfTheMeanAndTwoThatNoAmplitudeChanges) {
  const Turn turn = turnOf({.effects = effect("sample_gain", "")});
  EXPECT_NEAR(turn.errorCycles(1), 0.0150, 5e-5);
  EXPECT_NEAR(turn.errorCycles(2), 0.0024, 5e-5);
  EXPECT_NEAR(turn.closureCycles(0), 0.030, 4.0 * kRounding);
  EXPECT_NEAR(turn.closureCycles(1), 0.010, 4.0 * kRounding);
  for (std::size_t i = 0; i < 360; i += 11) {
    const double phase = turn.phase_rad[i], s0 = 3000.0 + 1000.0 * std::cos(phase);
    const double exact = std::atan2(std::sin(phase), std::cos(phase) + 0.5e-3 * 0.01 * s0);
    EXPECT_NEAR(std::remainder(turn.error_rad[i] - (exact - phase), 2.0 * kPi), 0.0, kRounding);
  }
  const Turn sunny = turnOf({.mean = 12'000.0, .effects = effect("sample_gain", "")});
  EXPECT_NEAR(sunny.errorCycles(1), 0.0600, 4e-4);
}

TEST(Nonlinearity, OfSecondOrderCancelsForFourStepsButShowsInTheClosure) {
  const Turn turn =
      turnOf({.effects = effect("nonlinearity", "cubic_per_electron2 = 0\nquadratic_per_electron = 1e-5")});
  EXPECT_LT(turn.peak() + std::abs(turn.mean()), kRounding);
  EXPECT_NEAR(turn.closureCycles(2), 0.020, 4.0 * kRounding);
  // Three steps: three cycles of qA/2 / (1 − 2qB), in proportion to A.
  for (double amplitude : {1000.0, 500.0}) {
    const Turn three = turnOf(
        {.steps = 3,
         .amplitude = amplitude,
         .effects = effect("nonlinearity", "cubic_per_electron2 = 0\nquadratic_per_electron = 1e-5")});
    const double cycles = 0.5e-5 * amplitude / (1.0 - 2e-5 * 3000.0);
    EXPECT_NEAR(three.errorCycles(3), cycles, 1e-3 * cycles) << amplitude;
    EXPECT_LT(three.otherCycles({3}), 0.51 * cycles * cycles + kRounding);
  }
}

// cos³ φ = ¾ cos φ + ¼ cos 3φ: four cycles of (κA²/4) / (1 − 3κB² − ¾κA²).
TEST(Nonlinearity, OfThirdOrderIsFourCyclesWithTheSquareOfTheAmplitude) {
  const struct {
    double amplitude, mean, cycles;
  } table[] = {{1000.0, 3000.0, 0.00026}, {4000.0, 6000.0, 0.00455}};
  for (const auto& row : table) {
    const Turn turn = turnOf({.amplitude = row.amplitude,
                              .mean = row.mean,
                              .effects = effect("nonlinearity", "cubic_per_electron2 = 1e-9")});
    const double a2 = 1e-9 * row.amplitude * row.amplitude, b2 = 1e-9 * row.mean * row.mean;
    EXPECT_NEAR(turn.errorCycles(4), 0.25 * a2 / (1.0 - 3.0 * b2 - 0.75 * a2), 2.0 * kRounding);
    EXPECT_NEAR(turn.errorCycles(4), row.cycles, 6e-6);
    EXPECT_LT(turn.otherCycles({4, 8}), 2.0 * kRounding);
  }
  const Turn turn = turnOf({.effects = effect("nonlinearity", "cubic_per_electron2 = 1e-9")});
  EXPECT_NEAR(turn.closureCycles(2), 0.018, 4.0 * kRounding);
}

// S_k + a S_{k−1} around the turn is p (1 − i a): an offset of atan a, no cycles and no closure.
TEST(Lag, OfTheRawExposureBeforeIsAConstantOnceTheSceneStandsStill) {
  const PhaseRig rig{.effects = effect("lag", "exposure_share = 0.01\nframe_share = 0.0")};
  const SensorModel model = rig.model();
  const double period_m = unambiguousRange(30_MHz).in(metre);
  const Light light = syntheticLight(360, 1, {30_MHz}, 5, [&](int x, int) {
    return std::vector<Way>{{1000.0, (x + 0.5) / 360.0 * period_m}};
  }, 500.0);
  const Samples collected = model.collect(light, {}, 1, 0);
  const auto exposed = model.readOut(collected, {}, 1, 1, 0, 0, {.collected = &collected});
  for (int x = 0; x < 360; x += 7) {
    const double phase = 2.0 * kPi * (x + 0.5) / 360.0;
    const double seen = -std::arg(std::complex<double>{exposed.range.phasors[0](x, 0)});
    EXPECT_NEAR(std::remainder(seen - phase, 2.0 * kPi), std::atan(0.01), kRounding) << x;
    const auto s = [&](int k) { return static_cast<double>(exposed.samples.tap(0, k, 0)(x, 0)); };
    EXPECT_NEAR(((s(0) + s(2)) - (s(1) + s(3))) / 1000.0, 0.0, 4.0 * kRounding);
  }
}

// b of the frame before, at another range: δφ = atan2(b r sin Δ, 1 + b r cos Δ).
TEST(Lag, OfTheFrameBeforePullsTowardsWhatThePixelSawThen) {
  const SensorModel model =
      modelOf(plainCamera(4, 2, 0.5, effect("lag", "exposure_share = 0\nframe_share = 0.02")));
  const Light before = evenLight(model, 3.0, 0.5), now = evenLight(model, 1.0, 0.9);
  const Samples collected = model.collect(before, {}, 1, 0);
  const double radian_per_metre = kSigmaToPhase80MHz;
  const double delta = (0.5 - 0.9) * radian_per_metre;
  const double expected =
      std::atan2(0.06 * std::sin(delta), 1.0 + 0.06 * std::cos(delta)) / radian_per_metre;
  const RangeImage remembered = model.expose(now, {}, 1, 1, 0, 0, {.collected = &collected}).range;
  EXPECT_NEAR(remembered.range_m(9, 9) - 0.9, expected, 1e-6);
  EXPECT_NEAR(model.expose(now, {}, 1, 1).range.range_m(9, 9), 0.9, 1e-6);  // a first frame
  const Samples other = model.collect(syntheticLight(5, 5, {80_MHz}, 1, [](int, int) {
    return std::vector<Way>{{1.0, 0.5}};
  }), {}, 1, 0);
  EXPECT_NEAR(model.expose(now, {}, 1, 1, 0, 0, {.collected = &other}).range.range_m(9, 9), 0.9, 1e-6);
  EXPECT_TRUE(model.remembers());
  EXPECT_FALSE(model.withEffects({}).remembers());
}

TEST(ColumnComb, RepeatsAfterItsPeriodHasItsSpreadAndIsConstant) {
  const CameraInfo camera = cameraOfSize(20'000, 1);
  const ColumnComb comb{.period = 5000, .offset_electrons = 30.0, .gain = 0.0};
  Samples samples;
  samples.frequencies = {20_MHz};
  samples.steps = 4;
  samples.electrons.assign(4, {20'000, 1, 1000.0F});
  const Samples seen = comb.apply(samples, {Moment{}, camera}, Random{1, 1, 1});
  EXPECT_EQ(comb.apply(samples, {Moment{}, camera}, Random{2, 9, 1}).electrons, seen.electrons);
  double squares = 0.0;
  for (int x = 0; x < 5000; ++x) {
    const double offset = static_cast<double>(seen.electrons[2](x, 0)) - 1000.0;
    squares += offset * offset;
    EXPECT_EQ(seen.electrons[2](x, 0), seen.electrons[2](x + 15'000, 0));
  }
  EXPECT_NEAR(std::sqrt(squares / 5000.0), 30.0, 5.0 * 30.0 / std::sqrt(2.0 * 5000.0));  // 5 standard errors
  // A region of the chip has the pattern of its place, and another device another.
  Samples part = samples;
  part.electrons.assign(4, {100, 1, 1000.0F});
  const Samples cut = comb.apply(part, {Moment{}, camera, 7, 0}, Random{1, 1, 1});
  EXPECT_EQ(cut.electrons[1](0, 0), seen.electrons[1](7, 0));
  ColumnComb other = comb;
  other.device = 2;
  EXPECT_NE(other.apply(samples, {Moment{}, camera}, Random{1, 1, 1}).electrons, seen.electrons);
}

// Gains alone: column j's phase does not change, its amplitude does.
TEST(ColumnComb, OfGainAloneLeavesThePhaseOfEachColumn) {
  const Turn turn = turnOf({.effects = effect("column_comb", "offset_electrons = 0\ngain = 0.02")});
  EXPECT_LT(turn.peak(), kRounding);
  EXPECT_GT(std::abs(turn.amplitude[0] - turn.amplitude[1]), 1.0);
  EXPECT_NEAR(turn.amplitude[0], turn.amplitude[4], 1e-2);
}

/// Σ S_k exp(−iθ_k) of both taps' difference, θ_k = 2π k/N.
std::complex<double> correlationOf(const Samples& samples, int x) {
  std::complex<double> sum;
  for (int k = 0; k < samples.steps; ++k) {
    const double theta = 2.0 * kPi * k / samples.steps;
    const auto of = [&](int tap) { return static_cast<double>(samples.tap(0, k, tap)(x, 0)); };
    sum += (of(0) - of(1)) * std::exp(std::complex{0.0, -theta});
  }
  return sum;
}

/// Charges of 2000 electrons are known to 2e-4 as float; eight of them are added up.
TEST(LearnedCharges, AddsItsChargesToTheCorrelationOfEveryMthColumn) {
  for (const int steps : {3, 4}) {
    Samples samples;
    samples.frequencies = {20_MHz}, samples.steps = steps, samples.taps = 2;
    for (int i = 0; i < 2 * steps; ++i)
      samples.electrons.emplace_back(6, 1, i % 2 == 0 ? 2000.0F + 10.0F * static_cast<float>(i) : 500.0F);
    const Learned columns{.title = {}, .terms = LearnedTerms::parsed({"in_phase_e += 30 * class(column, 2, 0)",
                                                                      "in_phase_e += -7 * class(column, 2, 1)",
                                                                      "quadrature_e += 12 * class(column, 2, 1)",
                                                                      "charge_percent += 1 * class(column, 2, 1)"})};
    const CameraInfo camera{};
    const Samples seen = columns.apply(samples, {Moment{}, camera}, Random{1, 1, 1});
    for (int x = 0; x < 6; ++x) {
      const std::complex<double> before = correlationOf(samples, x), after = correlationOf(seen, x);
      const auto expected = x % 2 == 0 ? before + 30.0 : 1.01 * before + std::complex{-7.0, -12.0};
      EXPECT_LT(std::abs(after - expected), 8 * 2e-4) << "column " << x << " of " << steps << " steps";
    }
    // A region of the chip has the columns of its place.
    const Samples cut = columns.apply(samples, {Moment{}, camera, 1, 0}, Random{1, 1, 1});
    EXPECT_EQ(cut.tap(0, 1, 0)(0, 0), seen.tap(0, 1, 0)(1, 0));
  }
}

TEST(AmbientSuppression, SparesTheWellAndCostsContrastInProportionToWhatItTakes) {
  const std::string well = effect("saturation", "full_well_electrons = 10000");
  const std::string circuit =
      effect("ambient_suppression", "share = 0.8\ncontrast_loss_per_electron = 1e-5");
  const SensorModel plain = modelOf(plainCamera(4, 2, 0.5, well)),
                    spared = modelOf(plainCamera(4, 2, 0.5, circuit + well));
  // 5000 electrons of signal per tap and 20 000 of sun: the emptier tap holds 25 000 − 2500 |cos|.
  const Light light = evenLight(plain, 1.0, 0.9, 4.0);
  EXPECT_TRUE(plain.expose(light, {}, 1, 0).range.flags(3, 3) &
              static_cast<unsigned>(PixelFlag::Saturated));
  const auto seen = spared.expose(light, {}, 1, 0);
  EXPECT_EQ(seen.range.flags(3, 3), 0);
  const double phase = 0.9 * kSigmaToPhase80MHz;
  for (int k = 0; k < 4; ++k) {
    const double half = 2500.0 * std::cos(phase - 0.5 * kPi * k);
    const double removed = 0.8 * (25'000.0 - std::abs(half));
    EXPECT_NEAR(seen.samples.tap(0, k, 0)(3, 3), 25'000.0 - removed + half * (1.0 - 1e-5 * removed), 0.02);
    EXPECT_NEAR(seen.samples.tap(0, k, 1)(3, 3), 25'000.0 - removed - half * (1.0 - 1e-5 * removed), 0.02);
  }
}

TEST(AmbientSuppression, TakesNoMoreThanItsLimit) {
  Samples samples;
  samples.frequencies = {20_MHz};
  samples.taps = 2;
  samples.electrons.assign(8, {1, 1, 5000.0F});
  const AmbientSuppression circuit{.share = 1.0, .limit_electrons = 1200.0, .contrast_loss = 0.0};
  samples = circuit.apply(samples, {Moment{}, CameraInfo{}}, Random{1, 1, 1});
  EXPECT_EQ(samples.electrons[5](0, 0), 3800.0F);
}

}  // namespace
}  // namespace toftwin::sim
