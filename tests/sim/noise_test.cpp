// SPDX-License-Identifier: Apache-2.0
// Noise through the whole sensor against the formulas.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "sim/effects/charge_noise.h"
#include "tests/sim/camera_testing.h"

namespace toftwin::sim {
namespace {

// σ_φ = √(2 (N_e + N_a) / N) / (m N_e). 100,000 pixels: a standard deviation is known to 0.22 %; 1
// % is 4.5 of that.
TEST(ShotNoise, GivesThePhaseNoiseOfTheFormula) {
  const struct {
    int steps;
    double ambient, sigma_rad;
  } table[] = {{4, 0.0, 0.009428}, {4, 3.0, 0.018856}, {3, 0.0, 0.010887}, {5, 0.0, 0.008433}};
  for (const auto& row : table) {
    const SensorModel model = modelOf(plainCamera(row.steps, 2, 0.75, kShotNoise));
    const auto exposed = model.expose(evenLight(model, 1.0, 0.9, row.ambient), {}, 1, 0);
    const double sigma = rangeStatistics(exposed.range).sigma * kSigmaToPhase80MHz;
    EXPECT_NEAR(sigma, std::sqrt(2.0 * (1e4 + 1e4 * row.ambient) / row.steps) / (0.75 * 1e4),
                0.01 * sigma);
    EXPECT_NEAR(sigma, row.sigma_rad, 0.01 * row.sigma_rad)
        << row.steps << " steps, ambient " << row.ambient;
  }
}

// Read noise of σ in each of two taps adds 2 σ² to the variance of a difference.
TEST(ReadNoise, AddsToThePhaseNoiseAsTheFormulaSays) {
  const SensorModel model = modelOf(plainCamera(
      4, 2, 0.75,
      std::string{kShotNoise} + "[[effect]]\ntype = 'read_noise'\nsigma_electrons = 80\n"));
  const double sigma =
      rangeStatistics(model.expose(evenLight(model, 1.0, 0.9), {}, 2, 0).range).sigma *
      kSigmaToPhase80MHz;
  const double expected = std::sqrt(2.0 * (1e4 + 2.0 * 80.0 * 80.0) / 4.0) / (0.75 * 1e4);
  EXPECT_NEAR(sigma, expected, 0.01 * expected);
}

// Three single-ended samples: σ swings by ±10 % three times per turn, for var Sₖ = B + A cos(φ −
// θₖ). From the propagated variance (2/N)² Σ var Sₖ sin²(φ − θₖ) / A² = (2/N)(B − A cos 3φ / 2) /
// A²; at the contrast of 0.4 ±10 %.
TEST(ShotNoise, OfThreeSingleEndedSamplesSwingsThreeTimesPerTurn) {
  const double contrast = 0.4;
  const SensorModel model = modelOf(plainCamera(3, 1, contrast, kShotNoise));
  const double mean = 0.5e4, amplitude = contrast * mean;
  for (double phase : {0.0, kPi / 6.0, kPi / 3.0, 2.0 * kPi / 3.0, 1.3}) {
    const double range_m = (phase + 2.0 * kPi) / kSigmaToPhase80MHz;
    const double sigma =
        rangeStatistics(model.expose(evenLight(model, 1.0, range_m), {}, 3, 0).range).sigma;
    if (phase == 0.0) continue;  // wraps at range 0
    const double expected =
        std::sqrt(2.0 / 3.0 * (mean - amplitude * std::cos(3.0 * phase) / 2.0)) / amplitude;
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
  const Light part = syntheticLight(50, 20, {80_MHz}, 1, [](int, int) {
    return std::vector<Way>{{1.0, 0.9}};
  });
  const auto region = model.expose(part, {}, 1, 5, 37, 91).range;
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 50; ++x)
      ASSERT_EQ(region.range_m(x, y), first.range_m(37 + x, 91 + y)) << x << ", " << y;
  }
}

TEST(Noise, OfTwoFramesIsIndependentAtEveryPixel) {
  const SensorModel model = modelOf(plainCamera(4, 2, 0.75, kShotNoise));
  const Light light = evenLight(model, 1.0, 0.9);
  const auto a = model.expose(light, {}, 1, 0).range.range_m,
             b = model.expose(light, {}, 1, 1).range.range_m;
  double product = 0.0, square = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    product += (static_cast<double>(a[i]) - 0.9) * (static_cast<double>(b[i]) - 0.9);
    square += std::pow(static_cast<double>(a[i]) - 0.9, 2);
  }
  EXPECT_LT(std::abs(product / square), 5.0 / std::sqrt(100'000.0));  // 6e-7 false alarms
}

/// Moments of many pixels' charges in two images, pair by pair of taps, through the effects one after the other
/// or all at once.
struct ChargeMoments {
  double mean = 0.0, variance = 0.0, correlation = 0.0, flagged = 0.0;
};
constexpr int kSide = 400;

ChargeMoments momentsOf(const Samples& samples, const Image<float>& of, const Image<float>& other) {
  ChargeMoments moments;
  const auto count = static_cast<double>(of.size());
  double other_mean = 0.0, other_variance = 0.0;
  for (std::size_t i = 0; i < of.size(); ++i) {
    moments.mean += static_cast<double>(of[i]) / count;
    other_mean += static_cast<double>(other[i]) / count;
    moments.flagged += !samples.flags.empty() && samples.flags[i] != 0 ? 1.0 / count : 0.0;
  }
  double product = 0.0;
  for (std::size_t i = 0; i < of.size(); ++i) {
    const double a = static_cast<double>(of[i]) - moments.mean, b = static_cast<double>(other[i]) - other_mean;
    moments.variance += a * a / count;
    other_variance += b * b / count;
    product += a * b / count;
  }
  moments.correlation = product / std::sqrt(moments.variance * other_variance);
  return moments;
}

Samples evenCharges(float charge, int images) {
  Samples samples{.frequencies = {80_MHz}, .steps = images, .taps = 1};
  samples.electrons.assign(static_cast<std::size_t>(images), Image<float>{kSide, kSide, charge});
  return samples;
}

const std::vector<AnyEffect> kThree{ShotNoise{.fano = 1.3}, Saturation{.full_well_electrons = 1e5},
                                    ReadNoise{.sigma_electrons = 60.0}};

Samples stepByStep(Samples samples, const Conditions& now, std::uint64_t seed) {
  samples = ShotNoise{.fano = 1.3}.apply(std::move(samples), now, Random{seed, 0, 1});
  samples = Saturation{.full_well_electrons = 1e5}.apply(std::move(samples), now, Random{seed, 0, 2});
  return ReadNoise{.sigma_electrons = 60.0}.apply(std::move(samples), now, Random{seed, 0, 3});
}

/// 160,000 pixels: five standard errors of the difference of two means, √(2 V/n), and of two variances,
/// V √(2 · 2/n) for a Gaussian; and a saturated share's √(1/(2n)). In the dark; below, near, at and above
/// the full well.
TEST(ChargeNoise, IsThatOfItsThreeEffects) {
  const auto joint = ChargeNoise::from(kThree, 0);
  ASSERT_TRUE(joint);
  EXPECT_EQ(joint->read_place, 2u);
  const Moment moment{};
  CameraInfo camera;
  camera.width = camera.height = kSide;
  const Conditions now{moment, camera};
  constexpr double kPixels = kSide * kSide;
  for (const float charge : {-5.0F, 0.0F, 3.0F, 700.0F, 5e4F, 9.7e4F, 9.99e4F, 1e5F, 1.002e5F, 1.02e5F, 1.03e5F,
                             2e5F}) {
    const Samples seen = joint->apply(evenCharges(charge, 3), now, Random{5, 0, 1}, Random{5, 0, 3});
    const Samples expected = stepByStep(evenCharges(charge, 3), now, 6);
    for (std::size_t image = 0; image < 3; ++image) {
      const std::size_t other = (image + 1) % 3;
      const ChargeMoments a = momentsOf(seen, seen.electrons[image], seen.electrons[other]);
      const ChargeMoments b = momentsOf(expected, expected.electrons[image], expected.electrons[other]);
      SCOPED_TRACE(fmt::format("charge {}, image {}", charge, image));
      EXPECT_NEAR(a.mean, b.mean, 5.0 * std::sqrt(2.0 * b.variance / kPixels));
      EXPECT_NEAR(a.variance, b.variance, 5.0 * b.variance * std::sqrt(4.0 / kPixels));
      EXPECT_NEAR(a.flagged, b.flagged, 5.0 * std::sqrt(0.5 / kPixels));
      EXPECT_LT(std::abs(a.correlation), 5.0 / std::sqrt(kPixels));
    }
  }
}

TEST(ChargeNoise, KeepsMissingSamplesAndIsKeyedByThePixel) {
  const auto joint = ChargeNoise::from(kThree, 0);
  const Moment moment{};
  CameraInfo camera;
  camera.width = camera.height = kSide;
  Samples whole = evenCharges(99'900.0F, 2), part{.frequencies = {80_MHz}, .steps = 2, .taps = 1};
  part.electrons.assign(2, Image<float>{30, 20, 99'900.0F});
  whole.electrons[1](45, 67) = part.electrons[1](5, 7) = std::nanf("");
  whole = joint->apply(std::move(whole), {moment, camera}, Random{5, 0, 1}, Random{5, 0, 3});
  part = joint->apply(std::move(part), {moment, camera, 40, 60}, Random{5, 0, 1}, Random{5, 0, 3});
  EXPECT_TRUE(std::isnan(whole.electrons[1](45, 67)));
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 30; ++x) {
      ASSERT_EQ(part.electrons[0](x, y), whole.electrons[0](40 + x, 60 + y));
      ASSERT_EQ(part.flags(x, y), whole.flags(40 + x, 60 + y));
    }
  }
}

/// Too little read noise would show Poisson's third moment and whole electrons; other effects in between see
/// charges with one noise and without the other.
TEST(ChargeNoise, IsOnlyForEffectsThatFollowEachOtherWithEnoughReadNoise) {
  const auto isJoint = [](const std::vector<AnyEffect>& effects) {
    return ChargeNoise::from(effects, 0).has_value();
  };
  EXPECT_TRUE(isJoint({ShotNoise{}, ReadNoise{.sigma_electrons = 20.0}}));
  EXPECT_TRUE(isJoint({ShotNoise{}, LensScatter{}, Saturation{}, WarmUp{}, ReadNoise{.sigma_electrons = 20.0}}));
  EXPECT_FALSE(isJoint({ShotNoise{}, ReadNoise{.sigma_electrons = 19.9}}));
  EXPECT_FALSE(isJoint({ShotNoise{.fano = 4.0}, ReadNoise{.sigma_electrons = 39.0}}));
  EXPECT_FALSE(isJoint({ShotNoise{}, Nonlinearity{}, ReadNoise{.sigma_electrons = 50.0}}));
  EXPECT_FALSE(isJoint({ShotNoise::none(), ReadNoise{.sigma_electrons = 50.0}}));
  EXPECT_FALSE(isJoint({ShotNoise{}, Saturation{}}));
  EXPECT_FALSE(isJoint({ReadNoise{.sigma_electrons = 50.0}}));
}

}  // namespace
}  // namespace toftwin::sim
