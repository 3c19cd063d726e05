// SPDX-License-Identifier: Apache-2.0
// What square waves do to a phase that is estimated as if they were sines: closed forms and tables.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/decode/decode.h"
#include "sim/sensor/correlate.h"
#include "tests/sim/synthetic_light.h"

namespace toftwin::sim {
namespace {

struct Wiggle {
  double peak_m = 0.0, mean_m = 0.0;
};

/// Decodes `pixels` ranges over one unambiguous range; error = decoded − true, wrapped.
Wiggle wiggleOf(Frequency frequency, int steps, const Waveform& emitted,
                const Waveform& demodulating, int harmonics = 301, int pixels = 3600) {
  const double period_m = unambiguousRange(frequency).in(metre);
  const auto rangeAt = [&](int x) { return (x + 0.5) / pixels * period_m; };
  const Light light = syntheticLight(pixels, 1, {frequency}, harmonics, [&](int x, int) {
    return std::vector<Way>{{1.0, rangeAt(x)}};
  });
  const Response response{
      .frequency = frequency,
      .contrast = 0.5,
      .electrons_per_radiance = 1e4,
      .harmonics = relativeHarmonics(emitted, demodulating, frequency, harmonics)};
  const RangeImage image = decode(correlate(light, {response}, steps, 2), {});
  std::vector<double> errors;
  Wiggle wiggle;
  for (int x = 0; x < pixels; ++x) {
    double error = static_cast<double>(image.range_m(x, 0)) - rangeAt(x);
    error -= period_m * std::round((error - wiggle.mean_m) / period_m);
    errors.push_back(error);
    wiggle.mean_m += (error - wiggle.mean_m) / (x + 1);
  }
  for (double error : errors)
    wiggle.peak_m = std::max(wiggle.peak_m, std::abs(error - wiggle.mean_m));
  return wiggle;
}

double inRadian(double range_m, Frequency frequency) {
  return range_m * 4.0 * std::numbers::pi * frequency.in(hertz) / kSpeedOfLight_m_per_s;
}

const Waveform kSquare{.shape = Waveform::Shape::Square};
const Waveform kSine{.shape = Waveform::Shape::Sine};

// |atan(x/(1−x)) − πx/2| at x = (1 − √(4/π − 1))/2. The pixel grid misses the peak by < 4e-7 of it.
TEST(Wiggling, OfSquareWavesAndFourStepsIsTheClosedForm) {
  const Wiggle wiggle = wiggleOf(30_MHz, 4, kSquare, kSquare);
  EXPECT_NEAR(inRadian(wiggle.peak_m, 30_MHz), 0.071114638, 0.001 * 0.071114638);
  EXPECT_NEAR(wiggle.mean_m, 0.0, 1e-5);
}

TEST(Wiggling, OfSquareWavesInMillimetresAtSixFrequencies) {
  const std::pair<Frequency, double> table[] = {{16_MHz, 106.04}, {20_MHz, 84.83},
                                                {30_MHz, 56.55},  {80_MHz, 21.21},
                                                {100_MHz, 16.97}, {120_MHz, 14.14}};
  for (const auto& [frequency, peak_mm] : table) {
    EXPECT_NEAR(1e3 * wiggleOf(frequency, 4, kSquare, kSquare).peak_m, peak_mm, 0.001 * peak_mm)
        << frequency.in(megahertz) << " MHz";
  }
}

TEST(Wiggling, OfSquareWavesByNumberOfSteps) {
  const std::pair<int, double> table[] = {
      {3, 0.019495}, {5, 0.004058}, {6, 0.019495}, {8, 0.008018}};
  for (const auto& [steps, peak_rad] : table) {
    const Wiggle wiggle = wiggleOf(30_MHz, steps, kSquare, kSquare);
    EXPECT_NEAR(inRadian(wiggle.peak_m, 30_MHz), peak_rad, 0.001 * peak_rad) << steps << " steps";
  }
}

TEST(Wiggling, VanishesWhereOneWaveformIsASine) {
  for (int steps : {3, 4, 5, 8}) {
    // What is left is the rounding of phasors and ranges to float: a few 1e-7 of 5 m.
    EXPECT_LT(wiggleOf(30_MHz, steps, kSquare, kSine).peak_m, 3e-6) << steps << " steps";
    EXPECT_LT(wiggleOf(30_MHz, steps, kSine, kSquare).peak_m, 3e-6) << steps << " steps";
  }
}

// Peak and constant delay of a square wave through an emitter's low pass, 30 MHz, four steps: the
// first 400 odd harmonics 1/n² / (1 + i n ω τ) summed in time, by a program of its own.
TEST(Wiggling, OfASlowEmitterIsSmallerAndDelaysTheLight) {
  const struct {
    Duration rise;
    double peak_mm, delay_mm;
  } table[] = {
      {1_ns, 55.25, 148.5}, {2_ns, 51.39, 287.3}, {4_ns, 45.76, 514.3}, {8_ns, 40.19, 783.8}};
  for (const auto& row : table) {
    Waveform emitted = kSquare;
    emitted.rise = row.rise;
    const Wiggle wiggle = wiggleOf(30_MHz, 4, emitted, kSquare);
    EXPECT_NEAR(1e3 * wiggle.peak_m, row.peak_mm, 0.001 * row.peak_mm)
        << row.rise.in(nanosecond) << " ns";
    EXPECT_NEAR(1e3 * wiggle.mean_m, row.delay_mm, 0.001 * row.delay_mm)
        << row.rise.in(nanosecond) << " ns";
  }
}

/// The independent way to the same numbers: correlation in time instead of by Fourier coefficients.
using Correlation = std::function<double(double phase)>;

/// The overlap of two pulses, centred on their zero and `emitted`, `reference` periods long.
Correlation overlapOfPulses(double emitted, double reference) {
  return [=](double phase) {
    const double shift = std::remainder(phase / (2.0 * std::numbers::pi), 1.0);
    double overlap = 0.0;
    for (int period = -1; period <= 1; ++period) {
      const double from = std::max(-emitted / 2.0, shift + period - reference / 2.0);
      const double to = std::min(emitted / 2.0, shift + period + reference / 2.0);
      overlap += std::max(0.0, to - from);
    }
    return overlap;
  };
}

Correlation clippedCosine(double clip) {
  return [=](double phase) { return std::clamp(std::cos(phase), -clip, clip); };
}

/// Error of the N-step estimate of a phase, radians.
double phaseError(const Correlation& correlation, double phase, int steps) {
  std::complex<double> sum;
  for (int k = 0; k < steps; ++k) {
    const double theta = 2.0 * std::numbers::pi * k / steps;
    sum += correlation(phase - theta) * std::polar(1.0, theta);
  }
  return std::arg(sum * std::polar(1.0, -phase));
}

// The harmonics above H that are left out are each at most (1/n²)/(sin πD sin πD') of the
// fundamental, and two of N odd ones leak: their sum is below 2 / (N H sin sin).
TEST(Wiggling, OfAnyDutyIsWhatTheOverlapOfPulsesGives) {
  constexpr int kPixels = 200, kHarmonics = 2001;
  const double period_m = unambiguousRange(30_MHz).in(metre);
  const double to_rad = 2.0 * std::numbers::pi / period_m;
  const struct {
    double emitted, reference;
    int steps;
    double peak_rad;
  } table[] = {{0.25, 0.5, 3, 0.0716738}, {0.25, 0.5, 4, 0.0711146}, {1.0 / 3.0, 0.5, 4, 0.0599359},
               {0.45, 0.5, 4, 0.0711146}, {0.4, 0.45, 3, 0.0194951}, {0.5, 0.5, 5, 0.0040584}};
  for (const auto& row : table) {
    Waveform emitted = kSquare, reference = kSquare;
    emitted.duty = row.emitted;
    reference.duty = row.reference;
    const Response response{.frequency = 30_MHz,
                            .contrast = 0.5,
                            .electrons_per_radiance = 1e4,
                            .harmonics = relativeHarmonics(emitted, reference, 30_MHz, kHarmonics)};
    const Light light = syntheticLight(kPixels, 1, {30_MHz}, kHarmonics, [&](int x, int) {
      return std::vector<Way>{{1.0, (x + 0.5) / kPixels * period_m}};
    });
    const RangeImage image = decode(correlate(light, {response}, row.steps, 2), {});
    const Correlation correlation = overlapOfPulses(row.emitted, row.reference);
    const double tail = 2.0 / (row.steps * kHarmonics * std::sin(std::numbers::pi * row.emitted) *
                               std::sin(std::numbers::pi * row.reference));
    double peak = 0.0;
    for (int x = 0; x < kPixels; ++x) {
      const double phase = (x + 0.5) / kPixels * 2.0 * std::numbers::pi;
      const double expected = phaseError(correlation, phase, row.steps);
      const double seen = std::remainder(static_cast<double>(image.range_m(x, 0)) * to_rad - phase,
                                         2.0 * std::numbers::pi);
      EXPECT_NEAR(seen, expected, tail + 1e-6)
          << row.emitted << ", " << row.steps << " steps, pixel " << x;
    }
    for (int i = 0; i < 20000; ++i) {
      peak = std::max(
          peak, std::abs(phaseError(correlation, 2.0 * std::numbers::pi * i / 20000.0, row.steps)));
    }
    EXPECT_NEAR(peak, row.peak_rad, 2e-7) << row.emitted << ", " << row.steps << " steps";
  }
}

/// The range of a Kinect v2 whose three frequencies show these phase errors: 110.5 mm per radian.
TEST(Wiggling, OfAKinectIsTheSumOfItsThreePhaseErrors) {
  constexpr int kPixels = 140, kHarmonics = 4001;
  const std::vector<Frequency> frequencies{80_MHz, 16_MHz, 120_MHz};
  const auto rangeAt = [](int x) { return 1.0 + 0.05 * x; };
  const Light light = syntheticLight(kPixels, 1, frequencies, kHarmonics, [&](int x, int) {
    return std::vector<Way>{{1.0, rangeAt(x)}};
  });
  const Waveform impulse{.shape = Waveform::Shape::Impulse};
  for (double clip : {0.9, 0.7, 0.5}) {
    const Waveform clipped{.shape = Waveform::Shape::ClippedSine, .clip = clip};
    const Waveform* waves[] = {&kSine, &clipped, &kSine};
    std::vector<Response> responses;
    for (std::size_t f = 0; f < 3; ++f) {
      responses.push_back(
          {.frequency = frequencies[f],
           .contrast = 0.5,
           .electrons_per_radiance = 1e4,
           .harmonics = relativeHarmonics(*waves[f], impulse, frequencies[f], kHarmonics)});
    }
    const RangeImage image =
        decode(correlate(light, responses, 3, 2),
               {.algorithm = DecodeSettings::Algorithm::KinectV2,
                .kinect = {.counts_per_electron = 0.01}});
    // A clipped sine's harmonics are below 1/n² of the fundamental, too.
    const double tail_m = 0.11045 * 2.0 / (3 * kHarmonics);
    double peak_mm = 0.0;
    for (int x = 0; x < kPixels; ++x) {
      const double phase_16 = 4.0 * std::numbers::pi * 16e6 * rangeAt(x) / kSpeedOfLight_m_per_s;
      // 18.737 m / 27 cycles: 110.45 mm per radian with the exact speed of light
      const double expected_m = kSpeedOfLight_m_per_s / 16e6 / 27.0 / (2.0 * std::numbers::pi) *
                                phaseError(clippedCosine(clip), phase_16, 3);
      const double seen_m = static_cast<double>(image.range_m(x, 0)) - rangeAt(x);
      EXPECT_NEAR(seen_m, expected_m, tail_m + 3e-6)
          << "clipped at " << clip << ", " << rangeAt(x) << " m";
      peak_mm = std::max(peak_mm, 1e3 * std::abs(seen_m));
    }
    EXPECT_GT(peak_mm, 1.0);
    EXPECT_LT(peak_mm, 7.0);
  }
}

}  // namespace
}  // namespace toftwin::sim
