// SPDX-License-Identifier: Apache-2.0
// What is said, and what is not.
#include "calib/loop/answer.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "calib/loop/discover.h"
#include "tests/loop/made_table.h"

namespace toftwin::loop {
namespace {

using testing::MadeRow;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

Discovery madeDiscovery(std::size_t rows, std::uint64_t seed, const testing::MadeError& error, const testing::MadeNoise& noise = [](const MadeRow&, double unit) { return 2.0 * unit; }) {
  auto discovery = discover(testing::madeReadings(rows, seed, error, noise), {});
  EXPECT_TRUE(discovery.ok());
  return *std::move(discovery);
}

TEST(Answer, ThatNoModelIsWrittenComesFirstWithTheReason) {
  Discovery d = madeDiscovery(400, 61, [](const MadeRow& row) { return 3.0 * std::sin(2.0 * std::numbers::pi * row.reference_mm / 342.0); });
  ASSERT_TRUE(d.is_written);
  EXPECT_THAT(answerOf(d).headline, HasSubstr("what goes with reference_mm"));
  d.is_written = false;
  EXPECT_THAT(answerOf(d).headline, AllOf(StartsWith("No model is written: "), HasSubstr("on rows that were not used"), Not(HasSubstr("what goes with"))));
  EXPECT_THAT(answerOf(d).effects, Each(StartsWith("Not written: ")));
  EXPECT_EQ(answerOf(d).tone, Answer::Tone::Open);
}

TEST(Answer, JumpsToOneSideAreNotSaidToBeToEither) {
  Discovery d = madeDiscovery(60, 62, [](const MadeRow&) { return 0.0; });
  const auto said = [&](int side) {
    d.no_readings = {{.kind = NoReading::Jumped, .rows = {1, 2, 3}, .low = 11.0, .high = 11.0, .side = side}};
    return answerOf(d).readings;
  };
  EXPECT_THAT(said(-1), Contains(AllOf(HasSubstr("jump by about 11.0 mm downwards"), Not(HasSubstr("either")))));
  EXPECT_THAT(said(1), Contains(HasSubstr("upwards")));
  EXPECT_THAT(said(0), Contains(HasSubstr("to either side")));
}

TEST(Jumps, KnowWhetherAllAreToOneSide) {
  const auto sideOf = [](double first, double second) {
    Evidence e;
    constexpr Eigen::Index kRows = 400;
    e.sigma = Eigen::VectorXd::Ones(kRows);
    Eigen::VectorXd residual(kRows);
    std::mt19937_64 random{63};
    std::normal_distribution<double> normal;
    for (Eigen::Index i = 0; i < kRows; ++i) residual[i] = normal(random) + (i % 14 == 3 ? first : i % 14 == 9 ? second : 0.0);
    const NoReadings found = findJumps(e, residual);
    EXPECT_GT(found.rows.size(), 40U);
    return found.side;
  };
  EXPECT_EQ(sideOf(-8.0, -8.0), -1);
  EXPECT_EQ(sideOf(8.0, 8.0), 1);
  EXPECT_EQ(sideOf(-8.0, 8.0), 0);
}

TEST(Answer, TheSameColumnsInTheOtherOrderAreNoAlternative) {
  const Discovery d = madeDiscovery(600, 16, [](const MadeRow& row) { return 0.12 * std::exp(-row.time_s / 200.0) * (row.column - 112.0); });
  ASSERT_FALSE(d.mean.effects.empty());
  for (const Effect& effect : d.mean.effects) {
    std::vector<std::string> own = effect.shape.covariates;
    std::ranges::sort(own);
    for (Alternative other : effect.alternatives) {
      std::ranges::sort(other.covariates);
      EXPECT_NE(other.covariates, own);
    }
  }
}

TEST(Search, TellsAHarmonicOfAKnownModulationAsOne) {
  const double unambiguous_mm = 0.5 * 299'792.458 / 16.0;
  const auto error = [&](const MadeRow& row) { return 3.0 * std::sin(2.0 * std::numbers::pi * row.reference_mm / (0.25 * unambiguous_mm) + 0.7); };
  table::Readings readings = testing::madeReadings(400, 64, error);
  readings.modulation_mhz = 16.0;
  const auto d = discover(readings, {});
  ASSERT_TRUE(d.ok());
  ASSERT_EQ(d->mean.effects.size(), 1U);
  const Shape& shape = d->mean.effects[0].shape;
  EXPECT_EQ(shape.name(), "harmonic");
  EXPECT_DOUBLE_EQ(shape.inner[0], 0.25 * unambiguous_mm);
  EXPECT_LE(shape.price, std::log(8.0));  // of a wave of any length it is the logarithm of some hundred
  EXPECT_THAT(sentenceOf(*d, d->mean.effects[0]), HasSubstr("a quarter of the unambiguous range"));
}

}  // namespace
}  // namespace toftwin::loop
