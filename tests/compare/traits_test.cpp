// SPDX-License-Identifier: Apache-2.0
// Characteristics from series and frames: what no coverage shows.
#include "planted.h"
#include "calib/compare/traits/traits.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "calib/compare/traits/least_squares.h"
#include "calib/compare/traits/veil.h"

namespace toftwin::compare {
namespace {

using testing::HasSubstr;

std::string errorOf(const Traits& traits) { return traits ? "no error" : traits.error().message; }

/// The curves through the rows are those that the numbers are of: without noise, they are what was planted.
TEST(FittedCurves, GoThroughTheRows) {
  std::vector<double> t, two, d, wave, signal, sigma;
  for (int i = 0; i < 200; ++i) {
    t.push_back(100.0 + 18.0 * i);
    two.push_back(1500.0 + 9.0 * std::exp(-18.0 * i / 100.0) + 6.0 * std::exp(-18.0 * i / 1200.0));
    d.push_back(0.5 + 0.03 * i);
    wave.push_back(3.0 + 0.7 * d.back() +
                   4.0 * std::cos(4.0 * std::numbers::pi * 30e6 / 299'792'458.0 * d.back()));
    signal.push_back(40.0 * std::pow(1.03, i));
    sigma.push_back(std::sqrt(4.0 + 9e3 / signal.back() + 1e4 / (signal.back() * signal.back())));
  }
  const std::vector<double> f{30e6};
  const auto drift = driftTraits(t, two);
  const auto harmonics = fittedHarmonics(d, wave, f);
  const auto law = fittedNoiseLaw(signal, sigma);
  ASSERT_TRUE(drift && harmonics && law);
  const auto offset = std::ranges::find(harmonics->traits, "offset", &Trait::name);
  ASSERT_NE(offset, harmonics->traits.end());
  EXPECT_NEAR(offset->value, 3.0 + 0.7 * (0.5 + 0.03 * 99.5), 1e-3) << "the line at the mean distance";
  EXPECT_STREQ(nameOf(drift->model), "two exponentials");
  EXPECT_EQ(drift->curve.name, "two exponentials");
  for (std::size_t i = 0; i < t.size(); ++i) {
    EXPECT_NEAR(drift->curve.at(t[i]), two[i], 1e-3);
    EXPECT_NEAR(harmonics->curve.at(d[i]), wave[i], 1e-3);
    EXPECT_NEAR(law->curve.at(signal[i]), sigma[i], 1e-3 * sigma[i]);
  }
  EXPECT_NEAR(drift->curve.at(t.back()) - drift->curve.at(t.front()), drift->traits.front().value, 1e-9);
}

/// What goes straight over all that is seen was told to reach 7e51 m, and to be 93 m at the edge.
TEST(Corner, IsNotToldWhereTheErrorIsALine) {
  int told = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Noise noise{seed};
    std::vector<double> x, e;
    for (int i = 0; i < 35; ++i) {
      x.push_back(0.025 * i);
      e.push_back(12.0 - 4.0 * x.back() + noise(0.3));
    }
    const auto corner = cornerTraits(x, e);
    if (!corner) {
      EXPECT_EQ(errorOf(corner), "corner: these rows do not tell it: the error does not fall off from the edge") << seed;
      continue;
    }
    ++told;
    for (const Trait& one : *corner) {
      EXPECT_LT(std::abs(one.value), 1e3) << seed << ' ' << one.name;
    }
  }
  EXPECT_LT(told, 40);
}

/// Of rows that show no fall an exponential was told, in 17 of 60: 174 m at the edge. One that is over before the
/// nearest row would be told by what nobody saw: e^−2.5 of it and less.
TEST(Corner, IsToldOnlyWhereAFallIsSeen) {
  int flats = 0, beyond = 0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    Noise noise{seed};
    std::vector<double> x, flat, sharp;
    for (int i = 0; i < 60; ++i) {
      x.push_back(0.1 + 0.015 * i);
      flat.push_back(2.0 + noise(1.0));
      sharp.push_back(2.0 + 400.0 * std::exp(-x.back() / 0.04) + noise(1.0));
    }
    flats += errorOf(cornerTraits(x, flat)).find("does not fall off from the edge") != std::string::npos;
    beyond += errorOf(cornerTraits(x, sharp)).find("the nearest row shows less than a tenth") != std::string::npos;
  }
  EXPECT_GE(flats, 57);  // BIC errs in some
  EXPECT_GE(beyond, 50);
}

/// Two speeds with ten readings each: nothing says by how much what is read at a speed is off together.
TEST(Motion, IsInDoubtWhereReadingsAreOfTooFewSpeeds) {
  Noise noise{1};
  std::vector<double> two, many, of_two, of_many;
  for (int i = 0; i < 20; ++i) {
    two.push_back(i < 10 ? 0.2 : 0.9), many.push_back(0.1 * i);
    of_two.push_back(7.0 * two.back() + noise(0.3)), of_many.push_back(7.0 * many.back() + noise(0.3));
  }
  const auto doubtful = motionTraits(two, of_two), plain = motionTraits(many, of_many);
  ASSERT_TRUE(doubtful && plain);
  EXPECT_THAT(doubtful->front().doubt, HasSubstr("20 rows have 2 different values"));
  EXPECT_EQ(plain->front().doubt, "");
}

/// 0.5 m/s one way: 0.05 more of the way is as 20 ms late where the plate is. Going back it is 20 ms early.
TEST(Latency, IsNotToldOfMotionOneWay) {
  Noise noise{3};
  const auto seen = [&](double turn_s, double scale) {
    std::vector<double> t, a, later, b;
    const auto path = [=](double s) { return s < turn_s ? 0.5 * s : turn_s - 0.5 * s; };
    for (int i = 0; i <= 30; ++i) {
      t.push_back(i / 30.0), later.push_back(t.back() + 0.01);
      a.push_back(path(t.back()) + noise(2e-4)), b.push_back(scale * path(later.back()) + noise(2e-4));
    }
    return latencyTraits(later, b, t, a);
  };
  EXPECT_THAT(errorOf(seen(2.0, 1.0)), HasSubstr("passes no place in both directions"));
  EXPECT_THAT(errorOf(seen(2.0, 1.1)), HasSubstr("passes no place in both directions"));
  const auto turned = seen(0.4, 1.1);
  ASSERT_TRUE(turned) << turned.error().message;
  EXPECT_LT(turned->front().low, 0.0);
  EXPECT_GT(turned->front().high, 0.0);
  EXPECT_LT(turned->front().high - turned->front().low, 3.0);
}

/// y = 2 + 3 x exactly at five places but for ±1 that is orthogonal to both: s² = 4/3, var(slope) = s²/Σx² =
/// 4/3/10.
TEST(LeastSquares, GivesTheErrorsOfAStraightLine) {
  const std::vector<double> x{-2, -1, 0, 1, 2}, y{2 - 6 + 0.5, 2 - 3 - 1, 2 + 1, 2 + 3 - 1, 2 + 6 + 0.5};
  // Residuals (0.5, −1, 1, −1, 0.5): sum 0, Σ x e = 0, Σ e² = 3.5.
  const auto fit = fitLeastSquares(
      [&](std::span<const double> p, std::size_t i) { return p[0] + p[1] * x[i]; }, y, {0.0, 0.0});
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->at[0], 2.0, 1e-9);
  EXPECT_NEAR(fit->at[1], 3.0, 1e-9);
  EXPECT_NEAR(fit->error(1), std::sqrt(3.5 / 3.0 / 10.0), 1e-6);
  EXPECT_NEAR(studentT(3), 3.18245, 1e-5);
  const Trait slope = fit->trait("slope", "", 1);
  EXPECT_NEAR(slope.high - slope.value, 3.18245 * std::sqrt(3.5 / 30.0), 1e-5);
}

TEST(LeastSquares, GivesNothingWhereRowsDoNotTellAParameter) {
  const std::vector<double> y{1.0, 1.1, 0.9, 1.0};
  EXPECT_FALSE(fitLeastSquares([](std::span<const double> p, std::size_t) { return p[0] + 2.0 * p[1]; }, y,
                               {0.0, 0.0}));
  EXPECT_FALSE(fitLeastSquares([](std::span<const double> p, std::size_t) { return p[0]; }, {}, {0.0}));
}

/// Of 200 pixels in 12 captures A has 0.3 to 0.85; B lacks 10 % of them by ±2 % by turns, and has 0.06 that A
/// lacks. However many A has in a capture, shares are known as well as the turns are.
TEST(Traits, TellWhatEachCameraLacksOfTheOthersPixels) {
  std::vector<double> a, b, both;
  for (int i = 0; i < 12; ++i) {
    a.push_back(0.3 + 0.05 * i), both.push_back(a.back() * (i % 2 == 0 ? 0.88 : 0.92));
    b.push_back(both.back() / 0.94);
  }
  const auto valid = validTraits(a, b, both, 200.0);
  ASSERT_TRUE(valid);
  ASSERT_EQ(valid->both.size(), 4u);
  const Trait &by_b = valid->both[2], &by_a = valid->both[3];
  EXPECT_EQ(by_b.name, kLackedByB);
  EXPECT_EQ(by_a.name, kLackedByA);
  EXPECT_NEAR(by_b.value, 0.1, 0.002);
  // sd 0.02, of 12 rows, weighted by A's share: 2.2 · 0.021 · 1.04 / √12.
  EXPECT_NEAR(by_b.high - by_b.value, 0.0138, 0.001);
  EXPECT_NEAR(by_a.value, 0.06, 1e-12);
  double mean_b = 0.0;
  for (const double one : b) mean_b += one / 12.0;
  EXPECT_NEAR(by_a.value - by_a.low, 0.5 / 200.0 / mean_b, 1e-12) << "half a pixel";
  const std::vector<double> half(12, 0.5), none(12, 0.0);
  const auto disjoint = validTraits(half, half, none, 200.0);
  EXPECT_EQ(disjoint->difference.front().value, 0.0);
  EXPECT_EQ(disjoint->both[2].value, 1.0);
  EXPECT_EQ(disjoint->both[2].high, 1.0);
}

TEST(Traits, CallAnErrorAtAnAmplitudeOfOneExtrapolated) {
  const std::vector<double> amplitude{100, 200, 400, 800, 1600}, error{1.0, 2.1, 2.9, 4.0, 5.1};
  const auto traits = amplitudeTraits(amplitude, error);
  ASSERT_TRUE(traits);
  ASSERT_EQ(traits->size(), 2u);
  EXPECT_TRUE((*traits)[0].is_extrapolated);
  EXPECT_FALSE((*traits)[1].is_extrapolated);
}

/// A step between two places, noise of a fiftieth of it: the places tell that it is between two of them,
/// and not how wide it is.
TEST(Traits, AnEdgesWidthThatIsKnownToNoFactorOfTenIsNotTold) {
  std::mt19937 random{5};
  std::normal_distribution<double> noise{0.0, 0.02};
  std::vector<double> x, value;
  for (int i = 0; i < 24; ++i) x.push_back(i), value.push_back((i < 12 ? 0.0 : 1.0) + noise(random));
  const auto traits = edgeTraits(x, value);
  ASSERT_TRUE(traits) << traits.error().message;
  ASSERT_EQ(traits->size(), 1u);
  EXPECT_THAT((*traits)[0].doubt, HasSubstr("how wide the edge is the values do not tell"));
}

TEST(Traits, SayWhatRowsCannotTell) {
  const std::vector<double> few{1, 2, 3}, same(20, 1.0), zero(20, 0.0),
      nothing(20, std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(errorOf(wrapTraits(nothing, 1.5)), HasSubstr("0 of 20 rows are finite"));
  EXPECT_THAT(errorOf(wrapTraits(same, 0.0)), HasSubstr("period"));
  EXPECT_THAT(errorOf(amplitudeTraits(same, same)), HasSubstr("all amplitudes are alike"));
  EXPECT_THAT(errorOf(amplitudeTraits(zero, same)), HasSubstr("must be positive"));
  EXPECT_THAT(errorOf(ambientTraits(same, same, few)), HasSubstr("one column has 20 rows, another 3"));
  EXPECT_THAT(errorOf(edgeTraits(same, same)), HasSubstr("one place"));
  EXPECT_THAT(errorOf(flyingTraits(Image<float>(10, 10, 1.0f))), HasSubstr("fewer than four rows cross"));
  EXPECT_THAT(errorOf(shadowTraits(Image<float>(10, 10, 1.0f), 0.5)), HasSubstr("fewer than four rows"));
  EXPECT_THAT(errorOf(noiseTraits({})), HasSubstr("0 frames"));
  EXPECT_THAT(errorOf(timingTraits(same)), HasSubstr("one after the other"));
  EXPECT_FALSE(driftTraits(same, same));
  EXPECT_FALSE(lagTraits(same, same));
  EXPECT_FALSE(latencyTraits(same, same, few, few));
  EXPECT_FALSE(cornerTraits(same, same));
  EXPECT_FALSE(noiseLawTraits(same, same));
}

/// Three captures of eight rows each.
TEST(Traits, OfLensScatterSayWhyTheyAreNotTold) {
  const std::vector<double> kinect{16e6, 80e6, 120e6}, two{20e6, 100e6}, error(24, 1.0), nothing(24, 0.0),
      ones(24, 1.0);
  std::vector<double> rising, first(24, 0.0);
  std::vector<std::size_t> capture;
  for (std::size_t i = 0; i < 24; ++i) rising.push_back(static_cast<double>(i * i)), capture.push_back(i / 8);
  std::fill_n(first.begin(), 8, 1.0);
  const auto why = [&](const std::vector<std::vector<double>>& slopes,
                       const std::vector<double>& frequency_hz) {
    return errorOf(veilTraits(slopes, error, frequency_hz, capture));
  };
  EXPECT_THAT(why({nothing, nothing, nothing}, kinect), HasSubstr("adds no light"));
  EXPECT_THAT(why({ones, ones, ones}, kinect), HasSubstr("all rows alike, as a constant does"));
  EXPECT_THAT(why({rising, rising}, two), HasSubstr("ranges of two frequencies alike"));
  EXPECT_THAT(why({first, first, first}, kinect), HasSubstr("one capture alone tells it"));
  EXPECT_TRUE(veilTraits(std::vector{rising, rising, rising}, error, kinect, capture).ok());
}

/// Frames of a simulated camera start at whole nanoseconds: rounding is no jitter that could change.
TEST(Traits, OfFrameTimingKnowNothingShorterThanATick) {
  const auto from = [](double first_s) {
    std::vector<double> start_s;
    for (int i = 0; i < 60; ++i) start_s.push_back(first_s + 33'333'333e-9 * i);
    return *timingTraits(start_s);
  };
  const auto soon = from(0.1), later = from(3700.0);
  for (const auto* one : {&soon, &later}) {
    EXPECT_NEAR((*one)[0].high - (*one)[0].low, 2e-6, 1e-8);
    EXPECT_EQ((*one)[1].low, 0.0);
    EXPECT_GE((*one)[1].high, 1e-6);
    EXPECT_LE((*one)[0].low, 33.333333);
    EXPECT_GE((*one)[0].high, 33.333333);
  }
}

/// A clean step in eight rows: none flies of eight crossings, and where none flies there is no side to hang on.
TEST(Traits, OfFlyingPixelsSayNothingOfASideWhereNoneFlies) {
  Image<float> range(16, 8, 2.0f);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) range(x, y) = 1.0f;
  }
  const auto traits = flyingTraits(range);
  ASSERT_TRUE(traits);
  ASSERT_EQ(traits->size(), 1u);
  EXPECT_EQ(traits->front().value, 0.0);
}

TEST(Traits, LeaveOutRowsThatAreNotFinite) {
  std::vector<double> speed, error;
  for (int i = 0; i < 10; ++i) {
    speed.push_back(i == 4 ? std::nan("") : 0.2 * i);
    error.push_back(i == 7 ? INFINITY : 3.0 * 0.2 * i + (i % 2 == 0 ? 0.01 : -0.01));
  }
  const auto traits = motionTraits(speed, error);
  ASSERT_TRUE(traits);
  EXPECT_EQ(traits->front().n, 8u);
  EXPECT_NEAR(traits->front().value, 3.0, 0.05);
}

}  // namespace
}  // namespace toftwin::compare
