// SPDX-License-Identifier: Apache-2.0
#include "sim/decode/decode.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include <toftwin/frame.h>

#include "sim/decode/demodulate.h"
#include "sim/decode/unwrap.h"
#include "sim/effects/random.h"
#include "sim/sensor/correlate.h"
#include "tests/sim/synthetic_light.h"

namespace toftwin::sim {
namespace {

constexpr double kPi = std::numbers::pi;
bool has(std::uint8_t flags, PixelFlag flag) { return (flags & static_cast<unsigned>(flag)) != 0; }

/// Sₖ = B + A cos(φ − θₖ) of one pixel per phase, made without the simulator.
Samples cosineSamples(std::vector<Frequency> frequencies, int steps,
                      const std::vector<std::vector<double>>& phases, double amplitude,
                      double mean) {
  Samples samples;
  samples.steps = steps;
  const int width = static_cast<int>(phases.front().size());
  for (std::size_t f = 0; f < frequencies.size(); ++f) {
    for (int k = 0; k < steps; ++k) {
      Image<float> image{width, 1};
      for (int x = 0; x < width; ++x) {
        image(x, 0) =
            static_cast<float>(mean + amplitude * std::cos(phases[f][static_cast<std::size_t>(x)] -
                                                           2.0 * kPi * k / steps));
      }
      samples.electrons.push_back(std::move(image));
    }
  }
  samples.frequencies = std::move(frequencies);
  return samples;
}

TEST(Demodulation, GivesPhaseAmplitudeAndMeanForEveryNumberOfSteps) {
  for (int steps : {3, 4, 5, 7, 12}) {
    const RangeImage image = decode(cosineSamples({20_MHz}, steps, {{1.234}}, 500.0, 2000.0), {});
    EXPECT_NEAR(std::arg(image.phasors[0](0, 0)), -1.234, 1e-6) << steps;
    EXPECT_NEAR(image.amplitude(0, 0), 500.0, 1e-3) << steps;
    EXPECT_NEAR(image.ambient(0, 0), 2000.0, 1e-2) << steps;
    EXPECT_NEAR(image.range_m(0, 0), 1.234 / (4.0 * kPi * 20e6) * kSpeedOfLight_m_per_s, 2e-6)
        << steps;
  }
}

TEST(Demodulation, PolarRowIsTheArcTangentInCycles) {
  std::vector<std::complex<float>> phasors;
  for (int i = -5000; i < 5000; ++i)
    phasors.push_back(std::polar(3.0F, static_cast<float>(i) * 6.2831853e-4F));
  phasors.insert(phasors.end(),
                 {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1}, {-1, -1}, {-1, 1}, {1, -1}});
  std::vector<float> cycles(phasors.size()), amplitudes(phasors.size());
  polarRow(phasors.data(), phasors.size(), 0.25F, cycles.data(), amplitudes.data());
  for (std::size_t i = 0; i < phasors.size(); ++i) {
    const std::complex<double> p{phasors[i]};
    const double off = -std::arg(p) / (2.0 * kPi) - 0.25 - static_cast<double>(cycles[i]);
    EXPECT_NEAR(off - std::round(off), 0.0, 1.5e-7) << p;  // float's rounding near 1
    EXPECT_GE(cycles[i], 0.0F);
    EXPECT_LT(cycles[i], 1.0F);
    EXPECT_NEAR(amplitudes[i], std::abs(p), 1e-6);
  }
}

TEST(Decode, SeesAWallBeyondTheUnambiguousRangeAsNearer) {
  const struct {
    Frequency f;
    double period_m;
  } table[] = {{16_MHz, 9.3685}, {80_MHz, 1.8737}, {120_MHz, 1.2491}, {30_MHz, 4.9965}};
  for (const auto& row : table) {
    EXPECT_NEAR(unambiguousRange(row.f).in(metre), row.period_m, 5e-5);
    const double beyond_m = row.period_m + 0.7;
    const double phase = 4.0 * kPi * row.f.in(hertz)*beyond_m / kSpeedOfLight_m_per_s;
    const RangeImage image = decode(cosineSamples({row.f}, 4, {{phase}}, 500.0, 2000.0), {});
    EXPECT_NEAR(image.range_m(0, 0), beyond_m - unambiguousRange(row.f).in(metre), 3e-6);
  }
}

std::vector<double> cyclesOf(const std::vector<Frequency>& frequencies, double range_m) {
  std::vector<double> cycles;
  for (Frequency f : frequencies) {
    const double turns = range_m / unambiguousRange(f).in(metre);
    cycles.push_back(turns - std::floor(turns));
  }
  return cycles;
}

TEST(Unwrapper, IsExactOverTheWholeCommonPeriod) {
  const std::pair<std::vector<Frequency>, double> table[] = {{{80_MHz, 16_MHz, 120_MHz}, 18.737},
                                                             {{30_MHz, 29_MHz, 28_MHz}, 149.896},
                                                             {{100_MHz, 15_MHz}, 29.979},
                                                             {{30_MHz}, 4.9965}};
  for (const auto& [frequencies, period_m] : table) {
    const Unwrapper unwrap{frequencies, kSpeedOfLight_m_per_s};
    EXPECT_NEAR(unwrap.unambiguousRange().in(metre), period_m, 5e-4);
    const std::vector<double> amplitudes(frequencies.size(), 1.0);
    for (int i = 0; i < 500; ++i) {
      const double range_m = (i + 0.37) / 500.0 * unwrap.unambiguousRange().in(metre);
      const Unwrapped joined = unwrap(cyclesOf(frequencies, range_m), amplitudes);
      ASSERT_NEAR(joined.range_m, range_m, 1e-9) << frequencies.size() << " frequencies";
      ASSERT_LT(joined.deviation_rad, 1e-9);
    }
  }
}

// One radian at frequency i moves the mean by its weight: c/4πfᵢ · wᵢ / Σw, w = (A f)².
TEST(Unwrapper, WeighsFrequenciesByWhatTheyAreWorth) {
  const std::vector<Frequency> frequencies{20_MHz, 100_MHz};
  const Unwrapper unwrap{frequencies, kSpeedOfLight_m_per_s};
  std::vector<double> cycles = cyclesOf(frequencies, 2.0);
  cycles[0] += 0.01;
  const double off_m = unwrap(cycles, std::vector<double>{2.0, 1.0}).range_m - 2.0;
  EXPECT_NEAR(
      off_m, 0.01 * unambiguousRange(20_MHz).in(metre) * (4.0 * 400.0) / (4.0 * 400.0 + 1e4), 1e-9);
}

TEST(KinectV2, UnwrapsExactlyOver18Metres) {
  const double unit_m = kSpeedOfLight_m_per_s / 480e6;
  for (int i = 1; i < 1800; ++i) {
    const double range_m = 0.0103 * i;
    const auto cycles = cyclesOf({80_MHz, 16_MHz, 120_MHz}, range_m);
    const Unwrapped joined = unwrapKinectV2(cycles[0], cycles[1], cycles[2], unit_m);
    ASSERT_NEAR(joined.range_m, range_m, 1e-9);
    ASSERT_LT(joined.deviation_rad, 1e-9);
  }
}

TEST(KinectV2, MovesBy110MillimetresPerRadianAtAnyFrequency) {
  const double unit_m = 3e8 / 480e6;  // as libfreenect2 counts: 625 mm
  const auto cycles = cyclesOf({80_MHz, 16_MHz, 120_MHz}, 3.21);
  const double at = unwrapKinectV2(cycles[0], cycles[1], cycles[2], unit_m).range_m;
  const double turn = 0.01 / (2.0 * kPi);  // 10 mrad
  EXPECT_NEAR(1e5 * (unwrapKinectV2(cycles[0] + turn, cycles[1], cycles[2], unit_m).range_m - at),
              110.52, 0.005);
  EXPECT_NEAR(1e5 * (unwrapKinectV2(cycles[0], cycles[1] + turn, cycles[2], unit_m).range_m - at),
              110.52, 0.005);
  EXPECT_NEAR(1e5 * (unwrapKinectV2(cycles[0], cycles[1], cycles[2] + turn, unit_m).range_m - at),
              110.52, 0.005);
}

TEST(KinectV2, ThresholdFallsFromWeakToStrong) {
  EXPECT_DOUBLE_EQ(kinectV2Threshold(50.0, 0.349, 0.611), 0.611);
  EXPECT_DOUBLE_EQ(kinectV2Threshold(5000.0, 0.349, 0.611), 0.349);
  // Between: exp((ln 500 · −0.5330578 · 0.30103 + 0.7694894) · 3.321928) = 0.4690
  EXPECT_NEAR(kinectV2Threshold(500.0, 0.349, 0.611), 0.4690, 5e-4);
}

struct UnwrapStatistics {
  double wrong = 0.0, dropped = 0.0, wrong_and_kept = 0.0, sigma_m = 0.0;
};

UnwrapStatistics unwrapStatistics(double sigma_rad, std::uint32_t trials) {
  const double unit_m = kSpeedOfLight_m_per_s / 480e6;
  const Random random{2026, 0, 0};
  const Random::Draw draws[] = {random.draw(0), random.draw(1), random.draw(2), random.draw(3)};
  UnwrapStatistics statistics;
  double squares = 0.0, right = 0.0;
  for (std::uint32_t i = 0; i < trials; ++i) {
    const double range_m = 1.0 + 7.0 * draws[3].uniform(i);
    std::vector<double> cycles = cyclesOf({80_MHz, 16_MHz, 120_MHz}, range_m);
    for (std::size_t f = 0; f < 3; ++f) {
      cycles[f] += sigma_rad * static_cast<double>(draws[f].normal(i)) / (2.0 * kPi);
      cycles[f] -= std::floor(cycles[f]);
    }
    const Unwrapped joined = unwrapKinectV2(cycles[0], cycles[1], cycles[2], unit_m);
    const double error_m = joined.range_m - range_m;
    const bool is_wrong = std::abs(error_m) > 0.2, is_dropped = joined.deviation_rad > 0.3490659;
    statistics.wrong += is_wrong ? 1.0 / trials : 0.0;
    statistics.dropped += is_dropped ? 1.0 / trials : 0.0;
    statistics.wrong_and_kept += is_wrong && !is_dropped ? 1.0 / trials : 0.0;
    if (!is_wrong) {
      squares += error_m * error_m;
      right += 1.0;
    }
  }
  statistics.sigma_m = std::sqrt(squares / right);
  return statistics;
}

// Table of another implementation of the same algorithm, given to the digits below. Tolerance: half
// of the last digit
// + 3 binomial standard errors of our trials (false alarm 0.3 % each, seed 2026 fixed).
TEST(KinectV2, FailsToUnwrapAsOftenAsItMust) {
  constexpr std::uint32_t kTrials = 400'000;
  const struct {
    double sigma, wrong, wrong_digit, dropped, dropped_digit, kept, kept_digit;
  } table[] = {{0.1, 0.0, 1e-5, 0.0, 0.02, 0.0, 1e-5},
               {0.2, 0.002, 1e-3, 0.22, 0.01, 2e-5, 1e-5},
               {0.3, 0.044, 1e-3, 0.51, 0.01, 1.3e-3, 1e-4},
               {0.4, 0.15, 0.01, 0.67, 0.01, 1.2e-2, 1e-3}};
  const auto near = [](double seen, double expected, double digit) {
    const double error = 3.0 * std::sqrt(std::max(expected, 1e-6) * (1.0 - expected) / kTrials);
    EXPECT_NEAR(seen, expected, 0.5 * digit + error);
  };
  for (const auto& row : table) {
    SCOPED_TRACE(row.sigma);
    const UnwrapStatistics seen = unwrapStatistics(row.sigma, kTrials);
    near(seen.wrong, row.wrong, row.wrong_digit);
    near(seen.dropped, row.dropped, row.dropped_digit);
    near(seen.wrong_and_kept, row.kept, row.kept_digit);
  }
}

// σ = 110.45 mm · √3 σ_φ with the exact speed of light; standard error of a deviation 1/√2n = 0.11
// %, 4 of them.
TEST(KinectV2, RangeNoiseIsThatOfTheThreePhases) {
  for (double sigma : {0.02, 0.1}) {
    const double expected_m = 0.110448 * std::sqrt(3.0) * sigma;
    EXPECT_NEAR(unwrapStatistics(sigma, 400'000).sigma_m, expected_m, 0.0045 * expected_m) << sigma;
  }
}

Light lightOfWays(const std::vector<Frequency>& frequencies, const std::vector<Way>& ways) {
  return syntheticLight(1, 1, frequencies, 1, [&](int, int) { return ways; });
}

std::vector<Response> sines(const std::vector<Frequency>& frequencies) {
  std::vector<Response> responses;
  for (Frequency f : frequencies) {
    responses.push_back(
        {.frequency = f, .contrast = 0.5, .electrons_per_radiance = 1e5, .harmonics = {1.0}});
  }
  return responses;
}

// r² of the emitter's triangle: half the way there and back is not the range when the emitter
// stands beside.
TEST(Baseline, ExactCorrectionUndoesAnEmitterBesideTheLens) {
  const double baseline_m = 0.045;
  for (double range_m : {0.5, 1.0, 4.0}) {
    for (double ray_x : {-0.5, 0.0, 0.4}) {
      const double there_m = std::sqrt(range_m * range_m - 2.0 * range_m * baseline_m * ray_x +
                                       baseline_m * baseline_m);
      const Light light = lightOfWays({16_MHz}, {{1.0, (there_m + range_m) / 2.0}});
      const Samples samples = correlate(light, sines({16_MHz}), 4, 2);
      const DecodeRays rays{Image<float>{1, 1, static_cast<float>(ray_x)}, {}};
      EXPECT_NEAR(decode(samples, {.baseline_length = 45_mm}, rays).range_m(0, 0), range_m, 3e-6);
      // Dropping L² reads too far by L² / 2 (s − L u).
      const DecodeSettings first_order{.baseline_length = 45_mm,
                                       .baseline = DecodeSettings::Baseline::FirstOrder};
      const double too_far_m =
          baseline_m * baseline_m / (2.0 * (there_m + range_m - baseline_m * ray_x));
      EXPECT_NEAR(decode(samples, first_order, rays).range_m(0, 0) - range_m, too_far_m, 3e-6);
    }
  }
}

TEST(SpeedOfLight, OfLibfreenect2ReadsTooFarBy7In10000) {
  const Light light = lightOfWays({80_MHz, 16_MHz, 120_MHz}, {{1.0, 4.0}});
  const Samples samples = correlate(light, sines(light.frequencies), 3, 2);
  const DecodeSettings settings{.algorithm = DecodeSettings::Algorithm::KinectV2,
                                .speed_of_light = 3e8};
  EXPECT_NEAR(1e3 * (decode(samples, settings).range_m(0, 0) - 4.0F), 2.77, 0.01);
}

// Two ways of the light in one pixel: linear in the phasor. The mixture may lie outside both.
TEST(FlyingPixel, IsThePhasorSumOfItsSurfaces) {
  for (Frequency f : {16_MHz, 80_MHz, 120_MHz}) {
    const double k = 2.0 * kPi * f.in(hertz) / kSpeedOfLight_m_per_s;
    const std::complex<double> sum =
        std::polar(0.3, -2.0 * k * 1.0) + std::polar(0.2, -2.0 * k * 1.7);
    double phase = -std::arg(sum);
    if (phase < 0.0) phase += 2.0 * kPi;
    const RangeImage image =
        decode(correlate(lightOfWays({f}, {{0.3, 1.0}, {0.2, 1.7}}), sines({f}), 4, 2), {});
    EXPECT_NEAR(image.range_m(0, 0), phase / (2.0 * k), 3e-6);
  }
}

TEST(Flags, SayWhyAPixelIsInvalid) {
  Samples samples = cosineSamples({20_MHz}, 4, {{1.0, 1.0, 1.0, 1.0, 5.0}}, 500.0, 2000.0);
  samples.flags = Image<std::uint8_t>{5, 1};
  samples.flags(0, 0) = static_cast<std::uint8_t>(PixelFlag::Saturated);
  for (auto& image : samples.electrons) image(1, 0) = 100.0F;
  samples.electrons[2](2, 0) = std::numeric_limits<float>::quiet_NaN();
  const RangeImage image = decode(samples, {.minimum_amplitude = 10.0, .farthest = 3_m});
  EXPECT_TRUE(has(image.flags(0, 0), PixelFlag::Saturated));
  EXPECT_TRUE(has(image.flags(1, 0), PixelFlag::LowAmplitude));
  EXPECT_TRUE(has(image.flags(4, 0), PixelFlag::OutOfRange));
  for (int x : {0, 1, 2, 4}) {
    EXPECT_TRUE(has(image.flags(x, 0), PixelFlag::Invalid)) << x;
    EXPECT_TRUE(std::isnan(image.range_m(x, 0))) << x;
  }
  EXPECT_EQ(image.flags(3, 0), 0);
  EXPECT_FALSE(std::isnan(image.range_m(3, 0)));
}

TEST(Flags, FrequenciesThatDisagreeAreInvalid) {
  const Samples samples = cosineSamples({100_MHz, 20_MHz}, 4, {{1.0}, {2.5}}, 500.0, 2000.0);
  EXPECT_TRUE(
      has(decode(samples, {.unwrap_threshold = 0.1_rad}).flags(0, 0), PixelFlag::UnwrapUnreliable));
  EXPECT_FALSE(has(decode(samples, {.unwrap_threshold = 3_rad}).flags(0, 0), PixelFlag::Invalid));
}

/// (S₀ + S₂ − S₁ − S₃) / A of four samples, single-ended, A = 1000, B = 3000, after `damage`.
template <class Damage>
double closure(const Damage& damage, double phase = 0.9) {
  Samples samples = cosineSamples({30_MHz}, 4, {{phase}}, 1000.0, 3000.0);
  damage(samples);
  float asymmetry = 0.0F;
  asymmetryRow(samples, 0, &asymmetry);
  return 2.0 * static_cast<double>(asymmetry) / 1000.0;  // asymmetry = (2/N) |Σ (−1)ᵏ Sₖ|
}

// What the fourth sample is good for: it is zero for everything outside the pixel, and not for what
// is wrong in it.
TEST(Closure, IsZeroForTheSceneAndNotForTheSamples) {
  EXPECT_NEAR(closure([](Samples&) {}), 0.0, 1e-6);
  EXPECT_NEAR(closure([](Samples& s) { s.electrons[0](0, 0) += 20.0F; }), 0.020, 1e-6);
  EXPECT_NEAR(closure([](Samples& s) { s.electrons[0](0, 0) *= 1.01F; }),
              0.030 + 0.010 * std::cos(0.9), 1e-6);
  EXPECT_GT(closure([](Samples& s) {
              for (auto& image : s.electrons) image(0, 0) -= 1e-5F * image(0, 0) * image(0, 0);
            }),
            0.001);  // quadratic: 0.020 |cos 2φ|
}

TEST(Closure, OfAQuadraticPixelIsThereAlthoughItsPhaseIsRight) {
  for (double phase : {0.0, 0.3, 1.4, 2.9}) {
    Samples samples = cosineSamples({30_MHz}, 4, {{phase}}, 1000.0, 3000.0);
    for (auto& image : samples.electrons) image(0, 0) -= 1e-5F * image(0, 0) * image(0, 0);
    const RangeImage image = decode(samples, {});
    EXPECT_NEAR(std::remainder(-std::arg(image.phasors[0](0, 0)) - phase, 2.0 * kPi), 0.0, 2e-6);
    float asymmetry = 0.0F;
    asymmetryRow(samples, 0, &asymmetry);
    // Σ (−1)ᵏ q A² cos²(φ − θₖ) = 2 q A² cos 2φ
    EXPECT_NEAR(2.0 * static_cast<double>(asymmetry) / 1000.0,
                0.020 * std::abs(std::cos(2.0 * phase)), 2e-6);
  }
}

TEST(Closure, IsZeroForTheThirdHarmonicAndNotForTheSecond) {
  const auto asymmetryOf = [](const Waveform& emitted, const Waveform& demodulating) {
    const Light light = syntheticLight(1, 1, {30_MHz}, 31, [](int, int) {
      return std::vector<Way>{{1.0, 1.3}};
    });
    const Response response{.frequency = 30_MHz,
                            .contrast = 0.5,
                            .electrons_per_radiance = 1e5,
                            .harmonics = relativeHarmonics(emitted, demodulating, 30_MHz, 31)};
    const Samples samples = correlate(light, {response}, 4, 2);
    float asymmetry = 0.0F;
    asymmetryRow(samples, 0, &asymmetry);
    return static_cast<double>(asymmetry) /
           static_cast<double>(decode(samples, {}).amplitude(0, 0));
  };
  const Waveform square{.shape = Waveform::Shape::Square};
  const Waveform narrow{.shape = Waveform::Shape::Square, .duty = 0.4};
  EXPECT_LT(asymmetryOf(square, square), 1e-6);
  EXPECT_GT(asymmetryOf(narrow, narrow), 0.05);
}

}  // namespace
}  // namespace toftwin::sim
