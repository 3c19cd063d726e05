// SPDX-License-Identifier: Apache-2.0
// The Kinect v2's decoder beyond unwrapping (which decode_test holds against the published failure
// rates).
#include "sim/decode/kinect_v2.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "sim/decode/decode_steps.h"
#include "sim/decode/kinect_v2_rows.h"
#include "sim/decode/unwrap.h"
#include "sim/effects/companding.h"
#include "sim/effects/random.h"
#include "sim/sensor/correlate.h"
#include "tests/sim/camera_testing.h"
#include "tests/sim/synthetic_light.h"

namespace toftwin::sim {
namespace {

const std::vector<Frequency> kFrequencies{80_MHz, 16_MHz, 120_MHz};

/// Three frequencies, three steps, one tap: amplitude A of each frequency, phase noise of
/// `sigma_rad`.
struct Pixel {
  double range_m = 2.0;
  double amplitude = 1000.0;
};
Samples samplesOf(int width, int height, const std::function<Pixel(int, int)>& pixelAt,
                  double sigma_rad = 0.0, std::array<double, 3> share = {1.0, 1.0, 1.0}) {
  Samples samples{.frequencies = kFrequencies, .steps = 3, .taps = 1};
  const Random random{7, 0, 0};
  for (std::size_t f = 0; f < 3; ++f) {
    for (int k = 0; k < 3; ++k) {
      Image<float> image{width, height};
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          const Pixel pixel = pixelAt(x, y);
          const double noise =
              sigma_rad *
              static_cast<double>(random.draw(f).normal(static_cast<std::uint32_t>(y * width + x)));
          const double phase =
              2.0 * kPi * pixel.range_m / unambiguousRange(kFrequencies[f]).in(metre) + noise;
          image(x, y) = static_cast<float>(5000.0 + pixel.amplitude * share[f] *
                                                        std::cos(phase - 2.0 * kPi * k / 3.0));
        }
      }
      samples.electrons.push_back(std::move(image));
    }
  }
  return samples;
}

DecodeSettings kinect() {
  return {.algorithm = DecodeSettings::Algorithm::KinectV2,
          .unwrap_threshold = 0.6108653_rad,
          .kinect = {.amplitude_multipliers = {1.0, 1.0, 1.0}}};
}

/// Phases of one range, of which that at 120 MHz is off by up to 0.2 cycles, and amplitudes of 30 to 10,000 counts.
TEST(KinectV2, JudgesDeviationsByRoughLogarithmsAsByTheThresholdItself) {
  constexpr std::size_t kWidth = 20'000;
  std::mt19937 random{5};
  std::uniform_real_distribution<float> off{0.0F, 0.2F}, exponent{1.5F, 4.0F};
  const double unit_m = kSpeedOfLight_m_per_s / 480e6;
  std::array<std::vector<float>, 3> cycles, amplitudes;
  for (std::size_t x = 0; x < kWidth; ++x) {
    const double turns[] = {0.4, 0.08, 0.6};  // of 0.75 m
    const float counts = std::pow(10.0F, exponent(random));
    for (std::size_t f = 0; f < 3; ++f) {
      cycles[f].push_back(static_cast<float>(turns[f]) + (f == 2 ? off(random) : 0.0F));
      amplitudes[f].push_back(counts);
    }
  }
  const KinectLimits limits{.counts_per_electron = {1.0, 1.0, 1.0}, .least_counts = 0.0, .least_sum_counts = 0.0,
                            .unit_m = unit_m, .strong_rad = 0.349, .weak_rad = 0.611, .nearest_m = 0.1,
                            .farthest_m = 18.0, .baseline_m = 0.0, .baseline_square = 0.0};
  const std::vector<float> zeros(kWidth), ones(kWidth, 1.0F);
  std::vector<float> range(kWidth), brightness(kWidth);
  std::vector<double> deviation(kWidth), strongest(kWidth);
  std::vector<std::uint32_t> why(kWidth);
  const KinectSeen seen{{cycles[0].data(), cycles[1].data(), cycles[2].data()},
                        {amplitudes[0].data(), amplitudes[1].data(), amplitudes[2].data()}, zeros.data(), ones.data()};
  measureKinectRow(seen, limits, kWidth,
                   {range.data(), brightness.data(), deviation.data(), strongest.data(), why.data()});
  int doubtful = 0, over = 0, under = 0;
  for (std::size_t x = 0; x < kWidth; ++x) {
    const double threshold = kinectV2Threshold(strongest[x], limits.strong_rad, limits.weak_rad);
    if ((why[x] & kDoubtful) != 0) {
      ++doubtful;
      EXPECT_NEAR(deviation[x] / threshold, 1.0, 1.3e-4) << x;
      continue;
    }
    const bool is_over = deviation[x] > threshold;
    EXPECT_EQ((why[x] & kUnreliable) == kUnreliable, is_over) << x << ": " << deviation[x] << ", " << strongest[x];
    if (deviation[x] > limits.strong_rad && deviation[x] < limits.weak_rad) ++(is_over ? over : under);
  }
  // What the logarithms leave open is a few in ten thousand, and both answers are given often.
  EXPECT_LT(doubtful, 20);
  EXPECT_GT(over, 1000);
  EXPECT_GT(under, 1000);
}

double spread(const RangeImage& image, double mean_m, int margin) {
  double squares = 0.0, n = 0.0;
  for (int y = margin; y < image.range_m.height() - margin; ++y) {
    for (int x = margin; x < image.range_m.width() - margin; ++x) {
      if (std::isnan(image.range_m(x, y))) continue;
      squares += std::pow(static_cast<double>(image.range_m(x, y)) - mean_m, 2);
      n += 1.0;
    }
  }
  return std::sqrt(squares / n);
}

// A weighted mean of nine with the kernel's weights: √Σg² / Σg = 0.33357 of the noise is left, and
// a little more since unlike neighbours weigh less. σ = 0.03 rad: weights vary by 7.2 (1 − cos)/2 ~
// 0.3 %. 148² pixels of which nine share their noise: standard error of the deviation 3/√(2 · 148²)
// = 1.4 %; four of them.
TEST(KinectV2Filter, LeavesAThirdOfTheNoiseOfAFlatWall) {
  const Samples samples = samplesOf(
      150, 150, [](int, int) { return Pixel{}; }, 0.03);
  DecodeSettings settings = kinect();
  const double filtered = spread(decode(samples, settings), 2.0, 1);
  settings.kinect.bilateral_filter = settings.kinect.edge_filter = false;
  const double raw = spread(decode(samples, settings), 2.0, 1);
  EXPECT_NEAR(raw, 0.110448 * std::sqrt(3.0) * 0.03, 0.02 * raw);
  EXPECT_NEAR(filtered / raw, 0.33357, 0.33357 * 0.06);
}

// A neighbour of opposite phase weighs g e^(−7.2) and a like one g: nothing is smeared over an
// edge.
TEST(KinectV2Filter, DoesNotMixTwoSurfaces) {
  Image<std::complex<float>> phasors{7, 5, std::complex<float>{1000.0F, 0.0F}};
  for (int y = 0; y < 5; ++y) {
    for (int x = 4; x < 7; ++x) phasors(x, y) = {-1000.0F, 0.0F};
  }
  const FilteredPhasors filtered = bilateralFilter(phasors, 3.0F);
  const double beside = (0.1131098 + 2 * 0.1069973), weight = std::exp(-1.442695 * 5.0);
  const double expected =
      1000.0 * (1.0 - beside - beside * weight) / (1.0 - beside + beside * weight);
  EXPECT_NEAR(filtered.phasors(3, 2).real(), expected, 0.02);
  EXPECT_NEAR(filtered.phasors(2, 2).real(), 1000.0, 1e-3);
  EXPECT_NEAR(filtered.unlikeness(3, 2), 3.0, 1e-6);
  EXPECT_NEAR(filtered.unlikeness(2, 2), 0.0, 1e-6);
  EXPECT_EQ(filtered.unlikeness(3, 0), 0.0F);  // the border is left alone
}

TEST(KinectV2Filter, TakesWeakNeighboursOnlyWhenItIsWeakItself) {
  Image<std::complex<float>> phasors{3, 3, std::complex<float>{1.0F, 0.0F}};
  phasors(1, 1) = {10.0F, 0.0F};
  EXPECT_NEAR(bilateralFilter(phasors, 3.0F).phasors(1, 1).real(), 10.0, 1e-5);
  EXPECT_NEAR(bilateralFilter(phasors, 20.0F).phasors(1, 1).real(), 0.1195716 * 10.0 + 0.8804284,
              1e-5);
  phasors(1, 1) = {0.0F, 0.0F};
  EXPECT_EQ(bilateralFilter(phasors, 3.0F).phasors(1, 1), (std::complex<float>{}));
}

TEST(KinectV2Filter, DropsAPixelThatHangsBetweenTwoSurfacesAndNotAStep) {
  const auto dropped = [](const std::function<double(int)>& depthAt, bool is_bright_alike) {
    Image<float> depth_m{9, 9}, brightness{9, 9};
    for (int y = 0; y < 9; ++y) {
      for (int x = 0; x < 9; ++x) {
        depth_m(x, y) = static_cast<float>(depthAt(x));
        brightness(x, y) = x < 4 || is_bright_alike ? 1000.0F : 600.0F;
      }
    }
    int count = 0;
    const Image<std::uint8_t> drops = edgePixels(depth_m, Image<std::uint8_t>{9, 9}, brightness);
    for (const std::uint8_t drop : drops.pixels()) count += drop;
    return count;
  };
  const auto between = [](double middle) {
    return [middle](int x) { return x < 4 ? 1.0 : x == 4 ? middle : 2.0; };
  };
  EXPECT_EQ(dropped(between(1.5), false), 7);   // column 4 of the inner seven rows
  EXPECT_EQ(dropped(between(1.04), false), 0);  // not 50 mm behind the near one
  EXPECT_EQ(dropped(between(1.98), false), 0);  // not 30 mm before the far one
  EXPECT_EQ(dropped(between(1.5), true), 0);    // as bright all over: a slanted surface
  EXPECT_EQ(dropped([](int x) { return 1.0 + 0.04 * x; }, false), 0);
}

TEST(KinectV2Decoder, MarksWhatTheEdgeFilterDropsAsMixed) {
  const auto edge = [](int x, int) {
    return Pixel{x < 8 ? 1.0 : x == 8 ? 1.31 : 2.0, x < 8 ? 2000.0 : 900.0};
  };
  DecodeSettings settings = kinect();
  const RangeImage with = decode(samplesOf(16, 9, edge), settings);
  settings.kinect.edge_filter = settings.kinect.bilateral_filter = false;
  const RangeImage without = decode(samplesOf(16, 9, edge), settings);
  EXPECT_NEAR(without.range_m(8, 4), 1.31, 1e-4);
  EXPECT_TRUE(std::isnan(with.range_m(8, 4)));
  EXPECT_TRUE(has(with.flags(8, 4), PixelFlag::Mixed));
  EXPECT_TRUE(has(with.flags(8, 4), PixelFlag::Invalid));
  EXPECT_EQ(with.flags(3, 4), 0);
}

TEST(KinectV2Decoder, WantsEnoughLightAtEachFrequencyAndInSum) {
  const auto flags = [](double amplitude, std::array<double, 3> share) {
    return decode(samplesOf(
                      1, 1,
                      [&](int, int) {
                        return Pixel{2.0, amplitude};
                      },
                      0.0, share),
                  kinect())
        .flags(0, 0);
  };
  EXPECT_EQ(flags(3.5, {1, 1, 1}), 0);
  EXPECT_TRUE(has(flags(3.2, {1, 1, 1}), PixelFlag::LowAmplitude));       // 9.6 in sum
  EXPECT_TRUE(has(flags(100.0, {1, 1, 0.02}), PixelFlag::LowAmplitude));  // 2 at one of them
  EXPECT_EQ(flags(100.0, {1, 1, 0.04}), 0);
}

TEST(KinectV2Decoder, MultipliersAreInTheThresholds) {
  const Samples samples = samplesOf(1, 1, [](int, int) { return Pixel{2.0, 3.5}; });
  DecodeSettings settings = kinect();
  settings.kinect.amplitude_multipliers = {1.0, 0.5, 1.0};
  EXPECT_TRUE(has(decode(samples, settings).flags(0, 0), PixelFlag::LowAmplitude));
}

// With a phase error of δ at 80 MHz only, the deviation is δ √(1 − 100/329). Threshold: 0.349 rad
// for the strongest frequency above 870 counts, 0.611 rad below 304.
TEST(KinectV2Decoder, TheStrongestFrequencySetsTheThresholdOfDisagreement) {
  const auto isInvalid = [](double deviation_rad, std::array<double, 3> counts) {
    Samples samples{.frequencies = kFrequencies, .steps = 3, .taps = 1};
    for (std::size_t f = 0; f < 3; ++f) {
      for (int k = 0; k < 3; ++k) {
        const double phase = 2.0 * kPi * 2.0 / unambiguousRange(kFrequencies[f]).in(metre) +
                             (f == 0 ? deviation_rad / std::sqrt(1.0 - 100.0 / 329.0) : 0.0);
        samples.electrons.emplace_back(
            1, 1, static_cast<float>(5000.0 + counts[f] * std::cos(phase - 2.0 * kPi * k / 3.0)));
      }
    }
    return has(decode(samples, kinect()).flags(0, 0), PixelFlag::UnwrapUnreliable);
  };
  EXPECT_FALSE(isInvalid(0.34, {1000, 1000, 1000}));
  EXPECT_TRUE(isInvalid(0.36, {1000, 1000, 1000}));
  EXPECT_TRUE(isInvalid(0.36, {100, 1000, 100}));
  EXPECT_FALSE(isInvalid(0.60, {100, 250, 100}));
  EXPECT_TRUE(isInvalid(0.62, {100, 250, 100}));
}

TEST(KinectV2Decoder, ASaturatedPixelIsInvalidAndSpoilsNoNeighbour) {
  Samples samples = samplesOf(9, 9, [](int, int) { return Pixel{}; });
  samples.flags = Image<std::uint8_t>{9, 9};
  samples.flags(4, 4) = static_cast<std::uint8_t>(PixelFlag::Saturated);
  for (auto& image : samples.electrons) image(4, 4) = 9000.0F;
  samples.electrons[0](4, 4) = 60000.0F;
  const RangeImage image = decode(samples, kinect());
  EXPECT_TRUE(std::isnan(image.range_m(4, 4)));
  EXPECT_NEAR(image.range_m(5, 4), 2.0, 1e-4);
}

TEST(KinectV2Decoder, BoundsAreOfDepthNotOfRange) {
  const Samples samples = samplesOf(1, 1, [](int, int) { return Pixel{2.0, 1000.0}; });
  DecodeSettings settings = kinect();
  settings.farthest = 1.9_m;
  EXPECT_TRUE(std::isnan(decode(samples, settings).range_m(0, 0)));
  const DecodeRays slanted{Image<float>{1, 1, 0.6F}, Image<float>{1, 1, 0.8F}};
  EXPECT_NEAR(decode(samples, settings, slanted).range_m(0, 0), 2.0, 1e-4);
}

/// A Kinect v2 whose pixels have a phase of their own, with and without tables of it.
SensorModel kinectWithPattern(bool with_tables) {
  std::string text = *SensorModel::presetText("kinect_v2");
  const auto replace = [&text](std::string_view from, std::string_view to) {
    text.replace(text.find(from), from.size(), to);
  };
  if (!with_tables) replace("phase_tables = true", "phase_tables = false");
  replace("\"clipped_sine\"", "\"sine\"");
  replace("\"first_order\"", "\"exact\"");
  replace("baseline_mm = 45.0", "baseline_mm = 0.0");
  return modelOf(text).withEffects({FixedPatternPhase{.sigma = 0.1_rad, .device = 5}});
}

// What the tables' steps leave: ±0.0000155 π rad at each frequency, evenly spread: 110.4 mm √(3/12)
// · 9.7e-5.
TEST(PhaseTables, TakeEachPixelsOwnPhaseOff) {
  const auto errorOfModel = [](const SensorModel& model) {
    const auto image = model.expose(evenLight(model, 0.05, 2.0), {}, 1, 0).range;
    return 1e3 * spread(image, 2.0, 1);
  };
  EXPECT_GT(errorOfModel(kinectWithPattern(false)), 3.0);
  EXPECT_LT(errorOfModel(kinectWithPattern(true)), 110.45 * 0.5 * 9.74e-5 + 0.002);
}

/// Magnitude of the code c = 0 … 1023, from the device's rule: steps of 1 << (c/128 − (c ≥ 128)).
double countsOfCode(int code) {
  int counts = 0;
  for (int c = 0; c < code; ++c) counts += 1 << (c / 128 - (c >= 128 ? 1 : 0));
  return counts;
}

Samples twoTaps(double first, double second) {
  return {.frequencies = {80_MHz},
          .steps = 1,
          .taps = 2,
          .electrons = {Image<float>{1, 1, static_cast<float>(first)},
                        Image<float>{1, 1, static_cast<float>(second)}}};
}

TEST(Companding, KnowsExactlyTheCodesOfTheDevice) {
  const Moment moment;
  CameraInfo camera;
  camera.width = camera.height = 1;
  const Conditions now{moment, camera};
  for (int code = 0; code < 1024; ++code) {
    const double here = countsOfCode(code), next = code < 1023 ? countsOfCode(code + 1) : here;
    for (double sign : {1.0, -1.0}) {
      for (double share : {0.0, 0.3, 0.7}) {
        const double counts = here + share * (next - here);
        const Samples seen = Companding{.counts_per_electron = 0.5}.apply(
            twoTaps(50'000.0 + sign * counts, 50'000.0 - sign * counts), now, Random{1, 0, 0});
        const auto a = static_cast<double>(seen.tap(0, 0, 0)(0, 0)),
                   b = static_cast<double>(seen.tap(0, 0, 1)(0, 0));
        ASSERT_NEAR(0.5 * (a - b), sign * (share < 0.5 ? here : next), 0.01)
            << code << ' ' << share;
        ASSERT_NEAR(a + b, 100'000.0, 0.02);
        ASSERT_EQ(seen.flags(0, 0), 0);
      }
    }
  }
}

/// Against 40,000 draws of noise, at 20 differences for each width: five standard errors, 3e-5 false alarms
/// in all.
TEST(Companding, HasTheMeanOverNoiseOfItsSteps) {
  constexpr int kDraws = 40'000;
  const Moment moment;
  const Conditions now{moment, CameraInfo{}};
  const auto differenceOf = [&](const Companding& converter, double a, double b) {
    const Samples seen = converter.apply(twoTaps(a, b), now, Random{1, 0, 0});
    return static_cast<double>(seen.tap(0, 0, 0)(0, 0)) - static_cast<double>(seen.tap(0, 0, 1)(0, 0));
  };
  std::mt19937 random{20263};
  std::normal_distribution<double> normal;
  for (const double sigma :
       {0.15, 0.3, 0.6}) {  // in steps; a step is two counts from 256 on, here four electrons
    for (int i = 0; i < 20; ++i) {
      const double difference = 700.0 + 0.37 * i;
      const Companding plain{.counts_per_electron = 0.5};
      Companding mean = plain;
      mean.mean_over.variance = 0.5 * 16.0 * sigma * sigma;  // of each of two taps
      double sum = 0.0, squares = 0.0;
      for (int k = 0; k < kDraws; ++k) {
        const double drawn = differenceOf(plain, 1000.0 + difference + 4.0 * sigma * normal(random), 1000.0);
        sum += drawn - difference, squares += (drawn - difference) * (drawn - difference);
      }
      const double of_draws = sum / kDraws;
      const double error = std::sqrt((squares / kDraws - of_draws * of_draws) / kDraws);
      EXPECT_NEAR(differenceOf(mean, 1000.0 + difference, 1000.0) - difference, of_draws, 5.0 * error + 1e-3)
          << sigma << ' ' << difference;
    }
  }
}

TEST(Companding, FlagsWhatIsBeyondItsLastCode) {
  const Moment moment;
  const Samples seen = Companding{.counts_per_electron = 1.0}.apply(
      twoTaps(30'000.0, 13'640.0), {moment, CameraInfo{}}, Random{1, 0, 0});
  EXPECT_TRUE(has(seen.flags(0, 0), PixelFlag::Saturated));
  EXPECT_NEAR(seen.tap(0, 0, 0)(0, 0) - seen.tap(0, 0, 1)(0, 0), 16'320.0, 0.01);
}

/// Rows are converted piece by piece. What repeats along a row, a charge beyond the last code with it, is converted alike.
TEST(Companding, IsTheSameInEveryPieceOfARow) {
  constexpr int kWidth = 1100, kPeriod = 100;
  for (const int taps : {1, 2}) {
    Samples samples{.frequencies = {80_MHz}, .steps = 1, .taps = taps};
    samples.electrons.assign(static_cast<std::size_t>(taps), Image<float>{kWidth, 1});
    for (int x = 0; x < kWidth; ++x)
      samples.electrons[0](x, 0) = x % kPeriod == 37 ? 30'000.0F : 13.7F * static_cast<float>(x % kPeriod);
    const Samples seen =
        Companding{.counts_per_electron = 1.0}.apply(samples, {Moment{}, CameraInfo{}}, Random{1, 0, 0});
    for (int x = 0; x < kWidth; ++x) {
      EXPECT_EQ(seen.electrons[0](x, 0), seen.electrons[0](x % kPeriod, 0)) << x;
      EXPECT_EQ(has(seen.flags(x, 0), PixelFlag::Saturated), x % kPeriod == 37) << x;
    }
  }
}

TEST(Correlator, IsTheSameInEveryPieceOfARow) {
  constexpr int kWidth = 1100, kPeriod = 100;
  const Light light = syntheticLight(kWidth, 1, {80_MHz}, 1, [](int x, int) {
    return std::vector{Way{.radiance = 1.0 + 0.01 * (x % kPeriod), .range_m = 1.0 + 0.02 * (x % kPeriod)}};
  });
  const Response response{.frequency = 80_MHz, .contrast = 0.6, .electrons_per_radiance = 1e4, .harmonics = {1.0}};
  const Samples seen = correlate(light, {response}, 3, 2);
  ASSERT_EQ(seen.electrons.size(), 6U);
  for (const Image<float>& electrons : seen.electrons)
    for (int x = kPeriod; x < kWidth; ++x) EXPECT_EQ(electrons(x, 0), electrons(x % kPeriod, 0)) << x;
}

}  // namespace
}  // namespace toftwin::sim
