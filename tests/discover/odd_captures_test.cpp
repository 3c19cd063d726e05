// SPDX-License-Identifier: Apache-2.0
// Captures that were bumped are named, and clean tables are not accused.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include <fmt/format.h>

#include "discovered.h"

namespace toftwin::discover {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// 60 captures of 15 rows; those from 20 to 22 were bumped. `per_fold`: an effect of exposure.
std::string bumpedTable(unsigned seed, double per_fold, bool has_captures = true) {
  std::mt19937 random{seed};
  std::normal_distribution<double> normal;
  std::string text = has_captures ? "capture," : "";
  text += "exposure_us,temp_C,error_mm\n";
  const double exposures[]{50, 100, 200, 400, 800};
  for (int capture = 0; capture < 60; ++capture) {
    const double exposure = exposures[random() % 5], offset = 0.6 * normal(random);
    for (int i = 0; i < 15; ++i) {
      const double bump = capture >= 20 && capture < 23 ? 14.0 : 0.0;
      const double error = per_fold * std::log(exposure / 200.0) + offset + bump + 2.0 * normal(random);
      if (has_captures) text += fmt::format("{},", capture);
      text += fmt::format("{},{:.2f},{:.2f}\n", exposure, 26.0 + 2.0 * normal(random), error);
    }
  }
  return text;
}

/// Two or three of them are open. The line of capture c's first row is 2 + 15 c.
TEST(OddCaptures, AreNamedWithTheirLinesAndHowFarTheyAreOff) {
  for (const double per_fold : {0.0, 2.9}) {
    for (unsigned seed = 1; seed <= 3; ++seed) {
      const TableDiscovery d = discovered(bumpedTable(seed, per_fold));
      ASSERT_THAT(d.odd, Not(IsEmpty())) << seed;
      std::size_t captures = 0;
      for (const OddRows& one : d.odd) {
        EXPECT_GE(one.first_line, 302u) << seed;
        EXPECT_LE(one.last_line, 346u) << seed;
        EXPECT_NEAR(one.size, 14.0, 3.5) << seed;
        captures += one.captures;
      }
      EXPECT_GE(captures, 2u) << seed;
      EXPECT_THAT(d.open.doubts, Contains(HasSubstr("perhaps moved or bumped: lines "))) << seed;
    }
  }
}

TEST(OddCaptures, AreRowsWhereNoColumnNamesCaptures) {
  const TableDiscovery d = discovered(bumpedTable(4, 0.0, false));
  ASSERT_THAT(d.odd, Not(IsEmpty()));
  EXPECT_EQ(d.odd[0].captures, 0u);
  EXPECT_THAT(d.open.doubts, Contains(HasSubstr("rows that follow each other are off")));
}

/// A strong effect is no bump: tan² at the largest angles, the steep start of a warm-up.
TEST(OddCaptures, AreNotWhatAnEffectExplains) {
  std::mt19937 random{5};
  std::normal_distribution<double> normal;
  for (int table = 0; table < 5; ++table) {
    std::string tilted = "incidence_deg,error_mm\n", warming = "time_s,error_mm\n";
    for (int i = 0; i < 300; ++i) {
      const double angle = (i * 77) % 75, time = 4.0 * i;
      const double tangent = std::tan(angle * std::numbers::pi / 180.0);
      tilted += fmt::format("{},{:.2f}\n", angle, 2.0 * tangent * tangent + 1.5 * normal(random));
      warming += fmt::format("{},{:.2f}\n", time, -12.0 * std::exp(-time / 150.0) + normal(random));
    }
    EXPECT_THAT(discovered(tilted).odd, IsEmpty());
    EXPECT_THAT(discovered(warming).odd, IsEmpty());
  }
}

TEST(OddCaptures, AreNotTheTailsOfNoise) {
  std::mt19937 random{6};
  std::student_t_distribution<double> heavy{3.0};
  std::normal_distribution<double> normal;
  int accused = 0;
  for (int table = 0; table < 20; ++table) {
    std::string text = "capture,temp_C,error_mm\n";
    double offset = 0.0;
    for (int i = 0; i < 300; ++i) {
      if (i % 10 == 0) offset = normal(random);
      text += fmt::format("{},{:.2f},{:.2f}\n", i / 10, 25.0 + normal(random), offset + heavy(random));
    }
    accused += !discovered(text).odd.empty();
  }
  EXPECT_LE(accused, 1);
}

}  // namespace
}  // namespace toftwin::discover
