// SPDX-License-Identifier: Apache-2.0
// Plans that confound are refused, and pass when they are mended as they say.
#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include <fmt/format.h>

#include "plans.h"

namespace toftwin::plan {
namespace {

using testing::HasSubstr;

std::string sweep(const std::string& more = "") {
  return "[[block]]\nname = 'sweep'\nkind = 'distance'\ndistance_m = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]\n" + more;
}

TEST(Check, RefusesDistanceThatGoesWithTimeInABlock) {
  const Check refused = checkOf(sweep("order = 'as_written'\n"));
  EXPECT_FALSE(refused.passes());
  EXPECT_THAT(refusals(refused), HasSubstr("block \"sweep\": distance goes with time (r = 1.00"));
  EXPECT_THAT(refusals(refused), HasSubstr("write order = \"random\" in this block"));
  EXPECT_TRUE(checkOf(sweep("order = 'random'\n")).passes());
}

TEST(Check, LooksAtTheOrderAndNotAtItsName) {
  // Up and down again by hand: each distance twice, its mean time the same.
  const Check passed = checkOf(
      "[[block]]\nname = 'sweep'\nkind = 'distance'\norder = 'as_written'\n"
      "distance_m = [0.5, 1.0, 1.5, 2.0, 2.0, 1.5, 1.0, 0.5]\n");
  EXPECT_TRUE(passed.passes()) << refusals(passed);
}

TEST(Check, RefusesExposureAngleAndAmbientThatGoWithTime) {
  const std::string order = "order = 'as_written'\n";
  EXPECT_THAT(
      refusals(checkOf("exposure_us = 100\n[[block]]\nname = 'b'\nkind = 'exposure'\ndistance_m = [1]\n"
                       "exposure_us = [100, 200, 400, 800]\n" +
                       order)),
      HasSubstr("block \"b\": exposure goes with time"));
  EXPECT_THAT(
      refusals(checkOf(
          "[[block]]\nname = 'b'\nkind = 'tilt'\ndistance_m = [1]\nangle_deg = [0, 20, 40, 60]\n" + order)),
      HasSubstr("block \"b\": angle goes with time"));
  EXPECT_THAT(refusals(checkOf("[[block]]\nname = 'b'\nkind = 'ambient'\ndistance_m = [1]\n"
                               "ambient_klx = [0, 10, 20, 60]\n" +
                               order)),
              HasSubstr("block \"b\": ambient goes with time"));
}

TEST(Check, RefusesABlockTooShortToBeRandomAndSaysHowManyRepeatsMendIt) {
  const std::string two =
      "[[block]]\nname = 'b'\nkind = 'ambient'\ndistance_m = [1]\nambient_klx = [0, 50]\n";
  const Check refused = checkOf(two);
  EXPECT_FALSE(refused.passes());
  EXPECT_THAT(refusals(refused), HasSubstr("write repeats = 2 in this block"));
  EXPECT_TRUE(checkOf(two + "repeats = 2\n").passes());
}

/// What a slow wait at the end of a block does: warming up has ended there, and only there it is far.
TEST(Check, RefusesDistanceThatGoesWithWarmingUpThoughNotWithTheOrder) {
  const std::string tail = "distance_m = [1, 1.001, 1.002, 1.003, 1.004, 1.005, 3]\norder = 'as_written'\n";
  const Check refused = checkOf(
      "warm_up_time_s = 10\npose_time_s = 1\n[[block]]\nname = 'b'\nkind = 'distance'\n"
      "interval_s = 100\n" +
      tail);
  EXPECT_THAT(refusals(refused), HasSubstr("block \"b\": distance goes with"));
}

TEST(Check, RefusesExposureThatGoesWithDistanceOverThePlan) {
  // Far away longer: the two are one thing, in whatever order.
  std::string toml = "exposure_us = 100\n";
  for (int i = 0; i < 8; ++i) {
    const int k = i % 4;
    toml += fmt::format("[[block]]\nname = 'b{}'\nkind = 'locked'\ndistance_m = [{}]\nexposure_us = [{}]\n",
                        i, k + 1, 100.0 * std::exp2(k));
  }
  const Check refused = checkOf(toml);
  EXPECT_THAT(refusals(refused),
              HasSubstr("over the whole plan distance cannot be told from the other covariates, most "
                        "of all exposure (it is a combination of the other covariates)"));
  EXPECT_THAT(refusals(refused),
              HasSubstr("add a block that changes distance while exposure stays as it is"));
  const Check mended = checkOf(toml + sweep() +
                               "[[block]]\nname = 'e'\nkind = 'exposure'\ndistance_m = [2]\n"
                               "exposure_us = [100, 200, 400, 800]\nrepeats = 2\n");
  EXPECT_TRUE(mended.passes()) << refusals(mended);
}

/// Near by short and far away by long exposures: each block tells exposure from distance, but not the plan.
TEST(Check, SaysThatBlocksShouldCoverTheSameValues) {
  const auto block = [](const char* name, double distance_m, double exposure_us) {
    return fmt::format("[[block]]\nname = '{}'\nkind = 'exposure'\ndistance_m = [{}]\nexposure_us = [{}, {}]\nrepeats = 4\n",
                       name, distance_m, exposure_us, 1.01 * exposure_us);
  };
  const std::string all = "exposure_us = 100\n";
  const Check refused = checkOf(all + block("near", 1.0, 100.0) + block("far", 3.0, 900.0));
  EXPECT_THAT(refusals(refused), HasSubstr("let \"near\" and \"far\", which change exposure while distance stays as it is, "
                                           "cover the same values of it"));
  const Check mended = checkOf(all + block("near", 1.0, 100.0) + block("far", 3.0, 100.0));
  EXPECT_TRUE(mended.passes()) << refusals(mended);
}

TEST(Check, RefusesDistanceThatGoesWithTimeOverThePlanThoughNotInABlock) {
  std::string toml;
  for (int i = 1; i <= 6; ++i) {
    toml += fmt::format("[[block]]\nname = 'b{0}'\nkind = 'locked'\ndistance_m = [{0}.0]\nrepeats = 4\n", i);
  }
  const Check refused = checkOf(toml);
  EXPECT_THAT(refusals(refused), HasSubstr("over the whole plan distance cannot be told"));
  EXPECT_THAT(refusals(refused), HasSubstr("come back to it"));
  const Check mended =
      checkOf("[[block]]\nname = 'all'\nkind = 'distance'\ndistance_m = [1, 2, 3, 4, 5, 6]\nrepeats = 4\n");
  EXPECT_TRUE(mended.passes()) << refusals(mended);
}

TEST(Check, RefusesAngleThatGoesWithDistanceOverThePlan) {
  std::string toml = "[[block]]\nname = 'b'\nkind = 'tilt'\n";
  for (int i = 0; i < 8; ++i) {
    const double angle = 8.0 * i, radian = angle * std::acos(-1.0) / 180.0, distance = 1.0 + 0.2 * i;
    toml +=
        fmt::format("[[block.pose]]\nposition_m = [{:.9f}, 0.0, {:.9f}]\neuler_deg = [0.0, {:.9f}, 0.0]\n",
                    distance * std::sin(radian), 2.0 - distance * std::cos(radian), -angle);
  }
  const Check refused = checkOf(toml);
  EXPECT_THAT(refusals(refused), HasSubstr("cannot be told from the other covariates, most of all"));
  const Check mended = checkOf(toml + sweep("repeats = 2\n"));
  EXPECT_TRUE(mended.passes()) << refusals(mended);
}

TEST(Check, NotesWhatAPlanCannotTell) {
  std::string notes;
  for (const Remark& one : checkOf(sweep()).remarks) {
    EXPECT_FALSE(one.refuses);
    notes += one.what + "\n";
  }
  for (const char* kind : {"warm_up", "exposure", "ambient", "checkerboard", "bright_dark", "foreground",
                           "scatter", "corner", "tilt", "moving", "dark", "near_field", "repeats"}) {
    EXPECT_THAT(notes, HasSubstr(fmt::format("no block of kind {}:", kind)));
  }
  EXPECT_THAT(notes, HasSubstr("no capture is locked"));
}

/// c/2 is 149.896 m MHz: 3.4 m are the period of 44.1 MHz, and 0.6 m + c/2f is 9.97 m of 16 MHz.
TEST(Check, NotesOfWhichFrequenciesTheDistancesAreAWholePeriod) {
  const auto spanOf = [](const char* distances) {
    std::string notes;
    for (const Remark& one :
         checkOf(fmt::format("[[block]]\nname = 'd'\nkind = 'distance'\ndistance_m = [{}]\nrepeats = 4\n",
                             distances))
             .remarks)
      notes += one.what + " | " + one.mend + "\n";
    return notes;
  };
  EXPECT_THAT(spanOf("0.6, 1, 2, 3, 4"),
              testing::AllOf(HasSubstr("0.6 to 4 m are a whole period of 45 MHz or more"),
                             HasSubstr("go on to 9.97 m for 16 MHz")));
  EXPECT_THAT(spanOf("0.6, 3, 6, 9, 10.6"), testing::Not(HasSubstr("whole period")));
  // c/2f of 30 MHz is 4.997 m.
  EXPECT_THAT(spanOf("0.6, 1, 2, 3, 4.9"), testing::Not(HasSubstr("begin anew")));
  EXPECT_THAT(
      spanOf("0.6, 1, 2, 3, 6"),
      testing::AllOf(HasSubstr("up to 6 m are beyond c/2f of 25 MHz and more"), HasSubstr("end before 5 m")));
}

/// Every seed passes: the drawn order is drawn until it does.
TEST(Check, PassesRandomOrdersOfEverySeed) {
  for (int seed = 0; seed < 200; ++seed) {
    const Check checked = checkOf(fmt::format("seed = {}\n", seed) + sweep());
    EXPECT_TRUE(checked.passes()) << seed << ": " << refusals(checked);
  }
}

TEST(Inflation, IsThatOfTwoColumnsFromTheirCorrelation) {
  // VIF = 1 / (1 − r²) for two columns.
  std::mt19937 random{5};
  std::normal_distribution<double> normal;
  std::vector<double> x(50), y(50);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = normal(random), y[i] = 2.0 * x[i] + normal(random);
  const double r = correlation(x, y);
  for (const double inflation : inflationOf({x, y})) EXPECT_NEAR(inflation, 1.0 / (1.0 - r * r), 1e-9);
}

TEST(Inflation, IsInfiniteOfWhatIsACombinationAndOfNothingElse) {
  std::mt19937 random{6};
  std::normal_distribution<double> normal;
  std::vector<double> x(30), y(30), sum(30), own(30);
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = normal(random), y[i] = normal(random), sum[i] = 3.0 * x[i] - 0.5 * y[i] + 7.0,
    own[i] = normal(random);
  }
  const auto inflation = inflationOf({x, y, sum, own});
  EXPECT_TRUE(std::isinf(inflation[0]) && std::isinf(inflation[1]) && std::isinf(inflation[2]));
  EXPECT_LT(inflation[3], 2.0);
}

}  // namespace
}  // namespace toftwin::plan
