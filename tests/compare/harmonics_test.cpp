// SPDX-License-Identifier: Apache-2.0
// Waves over distance: which are told, and which are in doubt.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/compare/traits/traits.h"
#include "calib/compare/traits/waves.h"
#include "planted.h"

namespace toftwin::compare {
namespace {

using testing::HasSubstr;

/// Six waves in 9.4 m, seen over 3.7 m by few rows: uncertain by more than a row scatters. Left out, they are 0.5 mm/m
/// of scale.
TEST(Harmonics, KeepUncertainWavesThatTheRowsSpeakFor) {
  for (const int n : {30, 60}) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
      Noise noise{seed};
      std::vector<double> d, e;
      for (int i = 0; i < n; ++i) {
        d.push_back(0.6 + 3.7 * i / (n - 1));
        const double phase = 4.0 * std::numbers::pi * 16e6 / 299'792'458.0 * d.back();
        e.push_back(1.2 * std::cos(6.0 * phase) + noise(0.13));
      }
      const auto fitted = fittedHarmonics(d, e, std::vector{16e6});
      ASSERT_TRUE(fitted) << n << ' ' << seed;
      EXPECT_EQ(fitted->orders, 3U) << n << ' ' << seed;
    }
  }
}

TEST(Harmonics, OfTwoCamerasHaveTheSameWaves) {
  std::vector<std::string> asked;
  double more_half_mm = 3.9;
  const auto fitWith = [&](const char* of, std::size_t orders, bool has_more) -> HarmonicFit {
    return [&, of, orders, has_more](std::size_t least) -> Result<FittedTraits> {
      if (least > 0) asked.push_back(of + std::to_string(least));
      if (least > orders && !has_more) return Error{Error::Code::InvalidArgument, "too few rows"};
      // A wave whose interval is so wide beside a residual of 1 mm.
      const double half_mm = least > 0 && has_more ? more_half_mm : 1.0;
      FittedTraits fitted{.traits = {{"wave", "mm", 0.0, -half_mm, half_mm}, {"offset"}, {"scale"}, {"residual", "mm", 1.0}}};
      fitted.orders = std::max(orders, least);
      return fitted;
    };
  };
  const auto alike = withTheSameWaves({fitWith("a", 2, true), fitWith("b", 2, true)});
  EXPECT_TRUE(asked.empty() && alike[0]->orders == 2 && alike[1]->orders == 2);
  const auto more = withTheSameWaves({fitWith("a", 2, true), fitWith("b", 3, true)});
  EXPECT_EQ(asked, std::vector<std::string>{"a3"});
  EXPECT_TRUE(more[0]->orders == 3 && more[1]->orders == 3);
  const auto too_few = withTheSameWaves({fitWith("a", 3, true), fitWith("b", 1, false)});
  EXPECT_TRUE(too_few[0]->orders == 3 && too_few[1]->orders == 1);
  more_half_mm = 4.1;
  const auto too_uncertain = withTheSameWaves({fitWith("a", 2, true), fitWith("b", 3, true)});
  EXPECT_TRUE(too_uncertain[0]->orders == 2 && too_uncertain[1]->orders == 3);
}

/// Of 10 MHz a period is 15 m: 1.9 m are 0.13 of it, a quarter of that of two waves, 0.38 of three, 0.51 of four.
TEST(Harmonics, TellNoWaveOfWhichLessThanHalfAPeriodIsSeen) {
  Noise noise{5};
  std::vector<double> d, e;
  for (int i = 0; i < 240; ++i) {
    d.push_back(0.5 + 1.9 * i / 239.0);
    e.push_back(3.0 + 20.0 * std::cos(4.0 * std::numbers::pi * 10e6 / 299'792'458.0 * d.back()) + noise(0.05));
  }
  const auto fitted = fittedHarmonics(d, e, std::vector{10e6});
  ASSERT_TRUE(fitted) << fitted.error().message;
  for (const Trait& one : fitted->traits) {
    for (const char* too_long : {"1 per", "2 per", "3 per"})
      EXPECT_THAT(one.name, testing::Not(HasSubstr(too_long))) << one.value;
  }
  EXPECT_THAT(fitted->not_told, testing::AnyOf(HasSubstr("less than half of a period is seen"),
                                               HasSubstr("3, 6, 2 and 1 per period are not told")));
}

/// Of 240 rows those from 1.95 to 2.6 m read 100 mm nearer, and 20 rows of a second session do not, as in the O3D303's
/// published ones: so much alike are neighbours that a curve by that keeps to none of them. Errors that go on by 0.9
/// are no other population.
TEST(Harmonics, AreInDoubtWhereRowsAreOfTwoSessions) {
  int doubted = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Noise noise{seed};
    std::vector<double> d, two, one_d, going_on;
    double last = noise(2.0);
    for (int i = 0; i < 240; ++i) {
      one_d.push_back(0.8 + 2.0 * i / 239.0), d.push_back(one_d.back());
      two.push_back(50.0 + noise(1.0) - (d.back() > 1.95 && d.back() < 2.6 ? 100.0 : 0.0));
      last = 0.9 * last + noise(0.87);
      going_on.push_back(8.0 * std::cos(16.0 * std::numbers::pi * 30e6 / 299'792'458.0 * d.back()) + last);
    }
    for (int i = 0; i < 20; ++i) d.push_back(1.8 + 1.3 * i / 19.0), two.push_back(50.0 + noise(5.0));
    const auto of_two = fittedHarmonics(d, two, std::vector{30e6}),
               alike = fittedHarmonics(one_d, going_on, std::vector{30e6});
    ASSERT_TRUE(of_two && alike) << seed;
    doubted += of_two->traits.back().doubt.find("more than one population") != std::string::npos;
    EXPECT_EQ(alike->traits.back().doubt, "") << seed;
  }
  EXPECT_GE(doubted, 8);
}

/// Six and four millimetres of four and one wave per period by 24 rows, which do not tell the latter: 2 mm/m of it are
/// in the scale. Where all waves are as small as they are uncertain, as of two equal cameras' difference, nothing is.
TEST(Harmonics, DoubtAScaleThatALeftOutWaveMayBeIn) {
  int doubted = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Noise noise{seed};
    std::vector<double> d, waves, none;
    for (int i = 0; i < 24; ++i) {
      d.push_back(0.5 + 4.5 * i / 23.0);
      const double phase = 4.0 * std::numbers::pi * 30e6 / 299'792'458.0 * d.back();
      waves.push_back(3.0 + 6.0 * std::cos(4.0 * phase + 0.7) + 4.0 * std::cos(phase + 1.0) + noise(1.5));
      none.push_back(noise(1.5));
    }
    const auto fitted = fittedHarmonics(d, waves, std::vector{30e6}), flat = fittedHarmonics(d, none, std::vector{30e6});
    ASSERT_TRUE(fitted && flat) << seed;
    const auto scaleOf = [](const FittedTraits& of) { return *std::ranges::find(of.traits, "scale", &Trait::name); };
    const Trait scale = scaleOf(*fitted);
    doubted += scale.doubt.find("a wave of 30 MHz") != std::string::npos || (scale.low <= 0.0 && 0.0 <= scale.high);
    EXPECT_EQ(scaleOf(*flat).doubt, "") << seed;
  }
  EXPECT_GE(doubted, 18);
}

/// What goes with the place in the image is taken off the dots where the distances tell it from a slope, and
/// nowhere else: captures of a wall at nine distances do, at two they do not.
TEST(FittedCurves, TakeOffWhatGoesSidewaysOnlyWhereItIsTold) {
  for (const int captures : {9, 2}) {
    Noise noise{7};
    std::vector<double> d, e;
    std::vector<std::size_t> cluster;
    for (int c = 0; c < captures; ++c) {
      const double nearest = 0.6 + 3.0 * c / (captures - 1);
      for (int i = 0; i < 20; ++i) {
        d.push_back(nearest * (1.0 + 0.01 * i)), cluster.push_back(static_cast<std::size_t>(c));
        e.push_back(2.0 + noise(0.5));
      }
    }
    const std::vector<double> f{30e6};
    const auto fitted = fittedHarmonics(d, e, f, {.of = cluster});
    ASSERT_TRUE(fitted) << captures << ": " << fitted.error().message;
    EXPECT_EQ(fitted->besides.size(), captures == 9 ? d.size() : 0U) << captures;
    EXPECT_EQ(static_cast<bool>(fitted->curve.at), captures == 9) << captures;
  }
}

/// Four rows fit a line and one wave; three do not, and say nothing of which wave it is.
TEST(Waves, AreInDoubtWhereTooFewRowsAreThereToFitThem) {
  const std::vector<double> f{20e6};
  const auto four = wavesOf(f, std::vector{4}), three = wavesOf(f, std::vector{3});
  const std::vector<double> rows{0.5, 1.0, 1.5};
  EXPECT_THAT(doubtsOf(four, three, rows), testing::ElementsAre(HasSubstr("3 rows")));
  EXPECT_THAT(doubtsOf(four, four, rows), testing::ElementsAre("")) << "there is no other";
}

}  // namespace
}  // namespace toftwin::compare
