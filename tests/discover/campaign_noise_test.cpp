// SPDX-License-Identifier: Apache-2.0
// What noise does to means over frames is no effect that a camera model lacks.
#include <gmock/gmock.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "calib/discover/campaign/captures/gather_capture.h"
#include "calib/discover/campaign/captures/light_noise.h"
#include "calib/discover/campaign/captures/reading.h"
#include "calib/discover/campaign/rows/rows.h"
#include "sim/decode/decode_steps.h"
#include "sim/sensor/factory_calibration.h"
#include "sim/sensor/waveform.h"
#include "tests/discover/searched.h"

namespace toftwin::discover {
namespace {

/// Of gates the tracer knows no range: what it takes to be quiet enough cannot be asked of it.
TEST_F(Searched, APulsedCameraIsSearchedToo) {
  const auto pulsed = [](const std::string& more) {
    return R"(
model = "Small pulsed camera"
[lens]
width = 28
height = 21
fx = 26.7
fy = 26.7
cx = 13.5
cy = 10.0
[[emitter]]
power_w = 2.0
half_angle_deg = 50.0
[pulse]
scheme = "two_gate"
width_ns = 40.0
rise_ns = 2.0
ambient_gate = true
exposure_us = 4000.0
open_share = 0.02
[sampling]
factory_calibration = "waveform"
[pixel]
electrons_per_radiance_s = 8.2e8
[decoder]
algorithm = "pulsed"
minimum_amplitude_electrons = 1000.0
nearest_m = 0.2
farthest_m = 5.8
[[effect]]
type = "shot_noise"
)" + more;
  };
  write("camera.toml", pulsed(""));
  simulateWith(
      pulsed("[[effect]]\ntype = \"time_walk\"\nper_e_fold_mm = 12.0\nreference_electrons = 20000.0\n"));
  CampaignJob few = job();
  few.trace.samples_per_pixel = 8;
  EXPECT_THAT(namesOf(search(few)), testing::Contains("time_walk"));
}

Frame frameOf(const Image<float>& range_m, const Image<float>& amplitude) {
  Frame frame;
  frame.camera = {range_m.width(), range_m.height(), 40.0, 40.0, 31.5, 23.5, {}, ""};
  frame.planes = {toPlane(PlaneKind::Range, Image<float>{range_m}),
                  toPlane(PlaneKind::Amplitude, Image<float>{amplitude})};
  return frame;
}

/// Amplitudes of 200 to 800 with noise of 60, of which a camera drops those below 250. The pixels that are
/// left are compared with the truth in 12 groups: five standard errors of each, 7e-6 false alarms in all.
TEST(GatherCapture, LeavesOutAmplitudesThatNoiseChose) {
  constexpr int kWidth = 64, kHeight = 48, kFrames = 8, kGroups = 12;
  constexpr float kNoise = 60.0F, kLeast = 250.0F;
  std::mt19937 random{20261};
  std::normal_distribution<float> normal;
  const auto truth = [](std::size_t i) {
    return 200.0F + 600.0F * static_cast<float>(i) / (kWidth * kHeight);
  };
  CaptureGatherer gatherer{plan::CaptureRecord{}};
  for (int k = 0; k < kFrames; ++k) {
    Image<float> range_m(kWidth, kHeight, std::nanf("")), amplitude(kWidth, kHeight);
    for (std::size_t i = 0; i < range_m.size(); ++i) {
      amplitude[i] = truth(i) + kNoise * normal(random);
      if (amplitude[i] >= kLeast) range_m[i] = 2.0F;
    }
    ASSERT_TRUE(gatherer.add(frameOf(range_m, amplitude)).ok());
  }
  const MeasuredCapture capture = gatherer.finish();
  std::vector<double> sums(kGroups), squares(kGroups), counts(kGroups);
  for (std::size_t i = 0; i < capture.log_amplitude.mean.size(); ++i) {
    if (!std::isfinite(capture.log_amplitude.mean[i])) continue;
    // The logarithm of a number with noise is less in the mean, by half its relative variance.
    const double a = static_cast<double>(truth(i)), relative = static_cast<double>(kNoise) / a;
    const double error =
        static_cast<double>(capture.log_amplitude.mean[i]) - std::log(a) + 0.5 * relative * relative;
    const std::size_t group = i * kGroups / capture.log_amplitude.mean.size();
    sums[group] += error, squares[group] += relative * relative / kFrames, counts[group] += 1.0;
  }
  EXPECT_EQ(counts[0], 0.0) << "200 to 250, below the cut";
  EXPECT_GT(counts[kGroups - 1], 250.0);
  for (std::size_t g = 0; g < kGroups; ++g)
    EXPECT_LE(std::abs(sums[g]), 5.0 * std::sqrt(squares[g])) << "group " << g << " of " << counts[g];
}

/// A long capture of a camera that warms up: its mean is of the middle.
TEST(GatherCapture, SaysTheMiddleOfItsTime) {
  CaptureGatherer gatherer{plan::CaptureRecord{}};
  for (int k = 0; k < 5; ++k) {
    Frame frame = frameOf(Image<float>(8, 8, 2.0F), Image<float>(8, 8, 500.0F));
    frame.moment.since_power_on = (100.0 + 8.0 * k) * second;
    frame.moment.temperatures = {{"sensor", (20.0 + 0.5 * k) * celsius}};
    ASSERT_TRUE(gatherer.add(frame).ok());
  }
  const MeasuredCapture capture = gatherer.finish();
  ASSERT_TRUE(capture.moment.since_power_on);
  EXPECT_NEAR(capture.moment.since_power_on->in(second), 116.0, 1e-9);
  ASSERT_EQ(capture.moment.temperatures.size(), 1U);
  EXPECT_NEAR(capture.moment.temperatures.front().value.in(celsius), 21.0, 1e-9);
}

/// Of a simulated camera of 20 and 80 MHz: 8 and 2 mm of range, the left half twice that.
Frame frameOfLight(float times = 1.0F) {
  constexpr int kWidth = 24, kHeight = 6;
  Frame frame = frameOf(Image<float>(kWidth, kHeight, 2.0F), Image<float>(kWidth, kHeight, 500.0F));
  std::vector<float> sigma_m;
  for (const float here : {8e-3F, 2e-3F})
    for (int i = 0; i < kWidth * kHeight; ++i)
      sigma_m.push_back(times * here * (i % kWidth < kWidth / 2 ? 2.0F : 1.0F));
  frame.planes.push_back(
      {PlaneKind::LightSigma, ElementType::F32, kWidth, kHeight, 2, Buffer::adopt(std::move(sigma_m))});
  frame.moment.exposures = {{{}, 1_ms, 20_MHz}, {{}, 1_ms, 80_MHz}};
  frame.moment.world_from_camera = Transform<World, Camera>{};
  return frame;
}

MeasuredCapture captureOf(const std::vector<Frame>& frames) {
  CaptureGatherer gatherer{plan::CaptureRecord{}};
  for (const Frame& frame : frames)
    if (auto added = gatherer.add(frame); !added) throw std::runtime_error(added.error().message);
  return gatherer.finish();
}

/// Two captures from one place count half each. Edges, in column 20, say nothing; far from where sigma
/// changes, a mean over neighbours is what each of them says.
TEST(LightNoise, IsThatOfTheHighestFrequencyAndSharedByThePlace) {
  std::vector<MeasuredCapture> captures{captureOf({frameOfLight(), frameOfLight()}),
                                        captureOf({frameOfLight(), frameOfLight()}),
                                        captureOf({frameOfLight(), frameOfLight()})};
  captures[2].moment.world_from_camera->translation_m = {0.1, 0.0, 0.0};
  auto traced = std::make_shared<TracedCapture>();
  traced->is_jump = Image<std::uint8_t>(24, 6);
  for (int y = 0; y < 6; ++y) {
    traced->is_jump(20, y) = 1;
    for (MeasuredCapture& capture : captures) capture.light_variance_m2(20, y) = 1.0F;
  }
  shareLightNoise({traced, traced, traced}, captures);
  const double per_m = 4.0 * std::numbers::pi * 80e6 / kSpeedOfLight_m_per_s;
  for (std::size_t c = 0; c < 3; ++c) {
    const double alike = c == 2 ? 1.0 : 2.0;
    for (const auto& [x, sigma_m] : {std::pair{3, 4e-3}, {22, 2e-3}}) {
      const double expected = alike * sigma_m * sigma_m;
      EXPECT_NEAR(static_cast<double>(captures[c].light_variance_m2(x, 3)), expected, 1e-5 * expected) << c;
      EXPECT_NEAR(static_cast<double>(captures[c].light_variance(x, 3)), per_m * per_m * expected,
                  1e-5 * per_m * per_m * expected);
    }
  }
}

TEST(MeasuredCapture, IsOfASimulatedCameraIfItsFramesSaySo) {
  Frame frame = frameOfLight();
  frame.provenance.kind = FrameKind::Simulated;
  EXPECT_TRUE(captureOf({frame, frame}).is_simulated);
  frame.provenance.kind = FrameKind::Real;
  EXPECT_FALSE(captureOf({frame, frame}).is_simulated);
}

TEST(LightNoise, IsHiddenWhereASimulatedCameraDoesNotSayIt) {
  Frame simulated = frameOfLight();
  simulated.provenance.kind = FrameKind::Simulated;
  EXPECT_FALSE(captureOf({simulated, simulated}).hides_light_noise);
  simulated.planes.pop_back();
  EXPECT_TRUE(captureOf({simulated, simulated}).hides_light_noise);
  simulated.moment.exposures = {{{}, 1_ms, {}}};  // a pulsed camera's nobody knows
  EXPECT_FALSE(captureOf({simulated, simulated}).hides_light_noise);
}

TEST(LightNoise, IsInTheFramesOwnNoiseWhereEachHasItsLight) {
  EXPECT_TRUE(captureOf({frameOfLight(), frameOfLight(1.1F)}).light_variance.empty());
  EXPECT_TRUE(captureOf({frameOf(Image<float>(8, 8, 2.0F), Image<float>(8, 8, 500.0F)),
                         frameOf(Image<float>(8, 8, 2.0F), Image<float>(8, 8, 500.0F))})
                  .light_variance.empty());
}

class OfFewPaths : public Searched {
 protected:
  OfFewPaths() { shared_paths_ = 64; }
};

/// What pixels that share paths have by chance, alike at each visit of a place, was told as a gain along the range.
TEST_F(OfFewPaths, WhatLightHasByChanceIsNoEffectOfTheCamera) {
  simulate("");
  const CampaignFinding finding = search(job());
  EXPECT_TRUE(finding.effects.empty()) << verdictOf(finding);
  EXPECT_GT(finding.finding.first_p, 0.01);
}

/// A drift at one place, which its light does not hide.
TEST_F(OfFewPaths, ADriftIsFoundAllTheSame) {
  simulate("[[effect]]\ntype = 'thermal_delay'\nper_degree_mm = 0.6\n");
  const CampaignFinding finding = search(job());
  ASSERT_EQ(finding.effects.size(), 1U) << verdictOf(finding);
  EXPECT_THAT(verdictOf(finding), testing::HasSubstr("thermal_delay"));
}

/// Two captures at one place count half each while they are searched together, and one each where it is asked how well
/// each is described.
TEST(LightNoise, IsEachCapturesOwnWhereTheyAreJudged) {
  std::vector<MeasuredCapture> shared(2);
  for (MeasuredCapture& one : shared) {
    one.light_variance_m2 = one.light_variance = Image<float>(4, 4, 8e-6F);
    one.light_captures = 2, one.light_stands = 2;
  }
  for (const MeasuredCapture& one : eachByItself(shared)) {
    EXPECT_EQ(one.light_variance_m2(1, 2), 4e-6F);
    EXPECT_EQ(one.light_variance(3, 3), 4e-6F);
    EXPECT_EQ(one.light_captures, 1U);
    EXPECT_EQ(one.light_stands, 1U);
  }
}

/// Scatter that is named and fitted, of which nothing is left: 62 to 73 % was stated, as tiles of the light err as one.
TEST_F(OfFewPaths, WhatTheLightLeavesIsNoPartOfWhatCanBeExplained) {
  simulate("[[effect]]\ntype = 'lens_scatter'\nveil = 0.0015\nhalo = 0.002\n");
  const CampaignFinding finding = search(job());
  ASSERT_THAT(namesOf(finding), testing::Contains("lens_scatter")) << verdictOf(finding);
  ASSERT_TRUE(finding.judgement);
  EXPECT_GT(finding.judgement->removed_high, 0.95) << verdictOf(finding);
}

/// The same number of the light's noise makes rows of it: 4 mm² of light beside 1 mm² of the frames.
TEST(LightNoise, CountsInTheRows) {
  MeasuredCapture capture;
  const Image<float> flat(4, 4, 2.0F);
  capture.range_m = {flat, Image<float>(4, 4, 1e-6F), 1.0};
  TracedCapture traced;
  traced.is_edge = Image<std::uint8_t>(4, 4);
  traced.tracing_variance_m2 = traced.tracing_variance = Image<float>(4, 4);
  const Reading declared{flat, flat};
  const double before = static_cast<double>(Cells{capture, traced, declared}.rootWeights(Channel::Range)[0]);
  capture.light_variance_m2 = capture.light_variance = Image<float>(4, 4, 4e-6F);
  const double after = static_cast<double>(Cells{capture, traced, declared}.rootWeights(Channel::Range)[0]);
  EXPECT_NEAR(before / after, std::sqrt(5.0), 1e-3);  // beside 0.02 mm of rounding
}

/// Amplitudes of m phasors of 1 with noise of 0.1 each. 100,000 draws: the mean of ln A is known to 1.8e-4 at
/// m = 3, and must be 0 within five of that and 1e-4 of higher orders.
TEST(TakeNoiseOff, TheMeanOfLogarithmsIsThatWithoutNoise) {
  constexpr int kDraws = 100'000;
  constexpr double kNoise = 0.1;
  std::mt19937 random{20262};
  std::normal_distribution<double> normal;
  for (const auto& [preset, frequencies] : {std::pair{"o3d303", 1}, {"generic_cw", 2}, {"kinect_v2", 3}}) {
    const auto model = sim::SensorModel::preset(preset);
    ASSERT_TRUE(model.ok()) << model.error().message;
    double sum = 0.0, squares = 0.0;
    for (int k = 0; k < kDraws; ++k) {
      double a = 0.0;
      for (int f = 0; f < frequencies; ++f)
        a += std::hypot(1.0 + kNoise * normal(random), kNoise * normal(random)) / frequencies;
      sum += std::log(a), squares += std::log(a) * std::log(a);
    }
    const double mean = sum / kDraws, variance = squares / kDraws - mean * mean;
    std::vector<MeasuredCapture> captures(1);
    captures[0].frames = 8;
    captures[0].log_amplitude = {Image<float>(1, 1, static_cast<float>(mean)),
                                 Image<float>(1, 1, static_cast<float>(variance / 8.0)), 1.0};
    takeNoiseOff(*model, captures);
    EXPECT_NEAR(captures[0].log_amplitude.mean[0], 0.0, 5.0 * std::sqrt(variance / kDraws) + 1e-4) << preset;
  }
}

/// A factory's table of a square wave's cyclic error, ±56 mm at 30 MHz, bends the noise of a phase: by half
/// of its second derivative times the variance, 0.6 mm at most for 0.025 rad. The mean of many readings
/// without it is the table's own.
TEST(TakeNoiseOff, TheMeanOfRangesIsThatWithoutNoise) {
  constexpr int kDraws = 100'000;
  constexpr double kNoise = 0.025 / (2.0 * std::numbers::pi);  // cycles
  std::mt19937 random{20263};
  std::normal_distribution<double> normal;
  const auto model = sim::SensorModel::preset("o3d303");
  ASSERT_TRUE(model.ok()) << model.error().message;
  sim::Waveform square;
  square.shape = sim::Waveform::Shape::Square;
  const sim::Response response{.frequency = 30_MHz,
                               .harmonics = sim::relativeHarmonics(square, square, 30_MHz, 7)};
  const std::vector<float> table = sim::trueCyclesOf(response, 4);
  const double turn_m = unambiguousRange(30_MHz).in(metre);
  double largest_mm = 0.0;
  for (double seen = 0.11; seen < 0.9; seen += 0.06) {
    std::vector<float> given{static_cast<float>(seen)};
    sim::linearise(table, given);
    const double free_m = turn_m * static_cast<double>(given.front());
    const auto offAt = [&](double noise) {
      given.front() = static_cast<float>(seen + noise);
      sim::linearise(table, given);
      return turn_m * static_cast<double>(given.front()) - free_m;
    };
    // Each draw with its opposite: what is straight cancels, and the mean's error is of the bend's own.
    double sum = 0.0, squares = 0.0, bend_squares = 0.0;
    for (int k = 0; k < kDraws; ++k) {
      const double noise = kNoise * normal(random), a = offAt(noise), b = offAt(-noise);
      sum += 0.5 * (a + b), squares += 0.5 * (a * a + b * b), bend_squares += 0.25 * (a + b) * (a + b);
    }
    const double mean_m = sum / kDraws, variance = squares / kDraws - mean_m * mean_m;
    std::vector<MeasuredCapture> captures(1);
    captures[0].frames = 8;
    captures[0].range_m = {Image<float>(1, 1, static_cast<float>(free_m + mean_m)),
                           Image<float>(1, 1, static_cast<float>(variance / 8.0)), 1.0};
    takeNoiseOff(*model, captures);
    largest_mm = std::max(largest_mm, 1e3 * std::abs(mean_m));
    // Five standard errors, and a tenth of the largest shift for what is beyond the second order.
    const double error_m = std::sqrt((bend_squares / kDraws - mean_m * mean_m) / kDraws);
    EXPECT_NEAR(static_cast<double>(captures[0].range_m.mean[0]), free_m, 5.0 * error_m + 0.06e-3) << seen;
  }
  EXPECT_GT(largest_mm, 0.5) << "there is something to take off";
}

}  // namespace
}  // namespace toftwin::discover
