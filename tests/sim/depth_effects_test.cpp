// SPDX-License-Identifier: Apache-2.0
// What happens to ranges after decoding: corrections that are not quite right, and filters.
#include <gmock/gmock.h>

#include <cmath>

#include <toftwin/nan.h>

#include "tests/sim/camera_testing.h"

namespace toftwin::sim {
namespace {

RangeImage imageOfRanges(int width, int height, const std::function<double(int, int)>& range_m) {
  RangeImage image{.range_m = {width, height},
                   .amplitude = {width, height, 1000.0F},
                   .ambient = {width, height},
                   .flags = {width, height},
                   .phasors = {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.range_m(x, y) = static_cast<float>(range_m(x, y));
  }
  return image;
}

template <class E>
RangeImage applied(const E& effect, RangeImage image, const Moment& moment = {}, History before = {}) {
  return effect.apply(std::move(image), {moment, CameraInfo{}, 0, 0, before}, Random{1, 1, 1});
}

/// Ranges of 2 m with normal noise of standard deviation `sigma_m`; prints nothing, seed and frame say all.
RangeImage noisy(double sigma_m, std::uint64_t frame, int width = 400, int height = 250) {
  RangeImage image = imageOfRanges(width, height, [](int, int) { return 2.0; });
  CameraInfo camera = cameraOfSize(width, height);
  return RangeNoise{.sigma = sigma_m * metre}.apply(std::move(image), {Moment{}, camera},
                                                    Random{20'261, frame, 3});
}

unsigned flagsAt(const RangeImage& image, int x, int y) { return image.flags(x, y); }
constexpr unsigned kMixed =
    static_cast<unsigned>(PixelFlag::Invalid) | static_cast<unsigned>(PixelFlag::Mixed);

TEST(TimeWalk, GoesWithTheLogarithmOfTheAmplitude) {
  RangeImage image = imageOfRanges(3, 1, [](int, int) { return 2.0; });
  image.amplitude[0] = 1e4F, image.amplitude[1] = 1e3F, image.amplitude[2] = 0.0F;
  image = applied(TimeWalk{.per_e_fold = 2_mm, .reference_electrons = 1e4}, image);
  EXPECT_EQ(image.range_m[0], 2.0F);
  EXPECT_NEAR(image.range_m[1], 2.0 + 2e-3 * std::log(10.0), 3e-7);
  EXPECT_EQ(image.range_m[2], 2.0F);  // nothing to go by
}

TEST(ResidualDrift, IsItsPolynomialAndTakesAThermalDelayOffExactly) {
  Moment moment;
  moment.temperatures = {{"sensor", 70_degC}, {"illumination", 45_degC}};
  const ResidualDrift drift{.per_degree = 0.5_mm, .per_degree_squared = 0.01_mm};
  const RangeImage image = imageOfRanges(1, 1, [](int, int) { return 2.0; });
  EXPECT_NEAR(applied(drift, image, moment).range_m[0], 2.0 + 1e-3 * (0.5 * 20.0 + 0.01 * 400.0), 3e-7);
  EXPECT_EQ(applied(drift, image).range_m[0], 2.0F);  // temperature unknown
  const SensorModel model = modelOf(plainCamera(
      4, 2, 0.5,
      "[[effect]]\ntype = 'thermal_delay'\nper_degree_mm = 0.5\nper_sensor_degree_mm = 0\n"
      "[[effect]]\ntype = 'residual_drift'\nper_degree_mm = -0.5\n"));
  EXPECT_NEAR(model.expose(evenLight(model, 1.0, 0.9), moment, 1, 0).range.range_m(5, 5), 0.9, 1e-6);
}

TEST(CalibrationTable, IsLinearBetweenItsKnotsAndConstantBeyond) {
  const CalibrationTable table{
      .first = 1_m, .spacing = 500_mm, .offsets_mm = {10.0, -20.0, 40.0}};
  const std::pair<double, double> expected[] = {{0.2, 10.0},  {1.0, 10.0}, {1.25, -5.0}, {1.5, -20.0},
                                                {1.75, 10.0}, {2.0, 40.0}, {9.0, 40.0}};
  for (const auto& [range_m, offset_mm] : expected) {
    const RangeImage image =
        applied(table, imageOfRanges(1, 1, [r = range_m](int, int) { return r; }));
    EXPECT_NEAR(image.range_m[0] - range_m, 1e-3 * offset_mm, 1e-6) << range_m;
  }
}

TEST(CalibrationTable, OfMoreThanFortyNineKnotsIsAnError) {
  std::string knots = "0";
  for (int i = 1; i < 49; ++i) knots += ", 1";
  const std::string effect = "[[effect]]\ntype = 'calibration_table'\noffsets_mm = [";
  EXPECT_EQ(errorOf(plainCamera(4, 2, 0.5, effect + knots + "]\n")), "");
  EXPECT_THAT(errorOf(plainCamera(4, 2, 0.5, effect + knots + ", 1]\n")),
              testing::HasSubstr("has 50 knots in offsets_mm; it can have at most 49"));
}

TEST(LowAmplitudeFilter, RejectsWhatIsBelowItsMinimumAndSaysWhy) {
  RangeImage image = imageOfRanges(3, 1, [](int, int) { return 2.0; });
  image.amplitude[0] = 299.0F, image.amplitude[1] = 300.0F, image.amplitude[2] = kNaN;
  image = applied(LowAmplitudeFilter{}, image);
  const unsigned why = static_cast<unsigned>(PixelFlag::Invalid) |
                       static_cast<unsigned>(PixelFlag::LowAmplitude);
  EXPECT_TRUE(std::isnan(image.range_m[0]) && std::isnan(image.range_m[2]));
  EXPECT_EQ(image.flags[0], why);
  EXPECT_EQ(image.flags[2], why);
  EXPECT_EQ(image.range_m[1], 2.0F);
  EXPECT_EQ(image.flags[1], 0);
}

/// A near surface left of column 10, a far one right of it, and column 10 in between.
RangeImage edge() {
  return imageOfRanges(21, 9, [](int x, int) { return x < 10 ? 1.0 : x == 10 ? 1.5 : 2.0; });
}

TEST(FlyingPixelFilter, TakesTheColumnBetweenTwoSurfacesAndLeavesBoth) {
  // Each pixel of column 10 agrees with two others of that column, those beside it with five.
  const RangeImage image = applied(FlyingPixelFilter{.supporters = 3}, edge());
  for (int y = 1; y < 8; ++y) {
    EXPECT_EQ(flagsAt(image, 10, y), kMixed);
    EXPECT_TRUE(std::isnan(image.range_m(10, y)));
    EXPECT_EQ(flagsAt(image, 9, y) + flagsAt(image, 11, y), 0U);
  }
  const RangeImage two = applied(FlyingPixelFilter{.supporters = 2}, edge());
  EXPECT_EQ(flagsAt(two, 10, 4), 0U);
}

TEST(FlyingPixelFilter, AllowsASlopeWithinItsTolerance) {
  // 15 mm per column at 2 m; allowed are 20 mm + 1 % of 2 m = 40 mm.
  const RangeImage slope = imageOfRanges(15, 15, [](int x, int) { return 2.0 + 0.015 * x; });
  EXPECT_EQ(applied(FlyingPixelFilter{}, slope).range_m, slope.range_m);
  const RangeImage steep = imageOfRanges(15, 15, [](int x, int) { return 2.0 + 0.06 * x; });
  EXPECT_EQ(flagsAt(applied(FlyingPixelFilter{}, steep), 7, 7), kMixed);  // only its column agrees
}

TEST(EdgeFilter, TakesBothSidesOfAnEdge) {
  const RangeImage image = applied(EdgeFilter{}, edge());
  for (int x = 0; x < 21; ++x)
    EXPECT_EQ(flagsAt(image, x, 4), x >= 9 && x <= 11 ? kMixed : 0U) << x;
}

TEST(MedianFilter, RemovesAnOutlierAndKeepsAStraightEdge) {
  RangeImage image = imageOfRanges(21, 9, [](int x, int) { return x < 10 ? 1.0 : 2.0; });
  const Image<float> clean = image.range_m;
  image.range_m(4, 4) = 5.0F;
  image.range_m(15, 3) = 0.3F;
  EXPECT_EQ(applied(MedianFilter{}, image).range_m, clean);
}

// The variance of the median of nine independent normals is 0.16610 (the integral of its order
// statistic). 1e5 pixels, each in nine windows: the estimate's own standard error is below 0.7 %.
TEST(MedianFilter, OfNineLeavesTheKnownShareOfTheNoise) {
  const double sigma = rangeStatistics(applied(MedianFilter{}, noisy(0.01, 1))).sigma / 0.01;
  EXPECT_NEAR(sigma * sigma, 0.1661, 5.0 * 2.0 * 0.007 * 0.1661);
}

// With σ_r far above the noise the weights are the image's alone: variance Σw² / (Σw)².
TEST(BilateralFilter, IsAGaussianMeanWhereTheRangeIsEven) {
  double sum = 0.0, squares = 0.0;
  for (int dy = -2; dy <= 2; ++dy) {
    for (int dx = -2; dx <= 2; ++dx) {
      const double weight = std::exp(-0.5 * (dx * dx + dy * dy));
      sum += weight, squares += weight * weight;
    }
  }
  const double share = squares / (sum * sum);
  const double sigma =
      rangeStatistics(applied(BilateralFilter{.sigma = 1.0, .sigma_range = 10_m}, noisy(0.01, 2))).sigma /
      0.01;
  // The borders' windows are smaller: 2 · (400 + 250) · 2 of 1e5 pixels with up to four times the
  // variance add 3 %; correlation makes the standard error 1.1 %.
  EXPECT_NEAR(sigma * sigma, share, 0.08 * share);
}

TEST(BilateralFilter, KeepsAnEdgeManySigmasHigh) {
  const RangeImage step = imageOfRanges(21, 9, [](int x, int) { return x < 10 ? 1.0 : 2.0; });
  const RangeImage image = applied(BilateralFilter{}, step);
  for (int x = 0; x < 21; ++x) EXPECT_EQ(image.range_m(x, 4), step.range_m(x, 4)) << x;
}

// A first-order recursion of independent noise: variance α / (2 − α).
TEST(TemporalFilter, LeavesTheKnownShareOfTheNoise) {
  const TemporalFilter filter{.new_share = 0.25, .jump = 1_m};
  RangeImage given = noisy(0.01, 0);
  for (std::uint64_t frame = 1; frame <= 40; ++frame)  // the start is forgotten to 0.75⁸⁰
    given = applied(filter, noisy(0.01, frame), {}, {.range = &given});
  const double share = std::pow(rangeStatistics(given).sigma / 0.01, 2);
  EXPECT_NEAR(share, 0.25 / 1.75, 5.0 * std::sqrt(2.0 / 1e5) * 0.25 / 1.75);
}

TEST(TemporalFilter, LagsBehindMotionAndTakesAJumpAtOnce) {
  const TemporalFilter filter{.new_share = 0.4, .jump = 50_mm};
  const auto at = [](double range_m) {
    return imageOfRanges(2, 2, [=](int, int) { return range_m; });
  };
  RangeImage given = at(2.0);
  for (int frame = 1; frame <= 60; ++frame)
    given = applied(filter, at(2.0 + 0.01 * frame), {}, {.range = &given});
  EXPECT_NEAR(2.6 - given.range_m[0], 0.01 * 0.6 / 0.4, 1e-5);  // (1 − α)/α frames
  EXPECT_EQ(applied(filter, at(3.0), {}, {.range = &given}).range_m[0], 3.0F);
  RangeImage hole = given;
  hole.range_m[0] = kNaN;
  EXPECT_EQ(applied(filter, at(2.61), {}, {.range = &hole}).range_m[0], 2.61F);
  EXPECT_EQ(applied(filter, at(2.61)).range_m[0], 2.61F);  // a first frame
}

TEST(TemporalFilter, ThatIsNotTheLastEffectIsAnError) {
  const std::string filter = "[[effect]]\ntype = 'temporal_filter'\n";
  const std::string delay = "[[effect]]\ntype = 'delay'\n", noise = "[[effect]]\ntype = 'shot_noise'\n";
  EXPECT_EQ(errorOf(plainCamera(4, 2, 0.5, delay + filter + noise)), "");
  EXPECT_THAT(errorOf(plainCamera(4, 2, 0.5, filter + delay)),
              testing::HasSubstr("temporal_filter must be the last effect on ranges"));
}

}  // namespace
}  // namespace toftwin::sim
