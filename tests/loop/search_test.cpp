// SPDX-License-Identifier: Apache-2.0
// What the search finds in tables whose errors are known.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "calib/loop/answer.h"
#include "calib/loop/discover.h"
#include "tests/loop/made_table.h"

namespace toftwin::loop {
namespace {

using testing::MadeRow;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

Discovery found(std::size_t rows, std::uint64_t seed, const testing::MadeError& error,
                const testing::MadeNoise& noise = [](const MadeRow&, double unit) { return 2.0 * unit; }) {
  auto discovery = discover(testing::madeReadings(rows, seed, error, noise), {});
  EXPECT_TRUE(discovery.ok());
  return *std::move(discovery);
}
std::vector<std::string> namesOf(const Explanation& explanation) {
  std::vector<std::string> names;
  for (const Effect& effect : explanation.effects)
    for (const std::string& name : effect.shape.covariates) names.push_back(name);
  return names;
}

TEST(Search, FindsNothingInNoiseAndSaysSoInGreen) {
  const Discovery d = found(400, 11, [](const MadeRow&) { return 0.0; });
  EXPECT_THAT(d.mean.effects, IsEmpty());
  EXPECT_GT(d.mean.p, 0.01);
  EXPECT_EQ(answerOf(d).tone, Answer::Tone::Good) << answerOf(d).headline;
}

TEST(Search, IsNotGreenOverAnOffsetAndAGain) {
  const Discovery d = found(400, 12, [](const MadeRow& row) { return 35.0 + 0.0475 * (row.reference_mm - 2500.0); });
  EXPECT_NE(answerOf(d).tone, Answer::Tone::Good);
  EXPECT_THAT(answerOf(d).headline, HasSubstr("% gain"));
  ASSERT_THAT(namesOf(d.mean), ElementsAre("range_mm"));
  // The gain's standard error is 2 mm / (1126 mm √320) = 1e-4.
  EXPECT_NEAR(d.mean.effects[0].coefficient[0], 0.0475, 4e-4);
}

TEST(Search, TellsAWaveByItsLength) {
  const Discovery d = found(400, 13, [](const MadeRow& row) { return 3.0 * std::sin(2.0 * std::numbers::pi * row.reference_mm / 342.0); });
  ASSERT_THAT(namesOf(d.mean), ElementsAre("range_mm"));
  EXPECT_EQ(d.mean.effects[0].shape.name(), "wave");
  // √6 σ Λ² / (π a L √n) with σ = 2, a = 3, L = 3900 mm and 320 rows is 1.1 mm.
  EXPECT_NEAR(d.mean.effects[0].shape.inner[0], 342.0, 5.0);
}

TEST(Search, TellsTwoDecaysAndAStep) {
  const Discovery d = found(500, 14, [](const MadeRow& row) {
    return -15.0 * std::exp(-row.time_s / 25.0) - 35.0 * std::exp(-row.time_s / 400.0) - (row.time_s >= 459.0 ? 10.0 : 0.0);
  });
  ASSERT_FALSE(d.mean.effects.empty());
  // Beside it something else comes once in a hundred tables.
  EXPECT_THAT(d.mean.effects[0].shape.covariates, ElementsAre("time_s"));
  EXPECT_TRUE(d.mean.effects[0].shape.has("step")) << d.mean.effects[0].shape.name();
  EXPECT_LT(d.unseen.last(), 2.4);  // 2 mm of noise, of 100 rows known to a fourteenth
}

TEST(Search, TellsAClassFromItsMultiples) {
  const Discovery d = found(600, 15, [](const MadeRow& row) { return std::fmod(row.column, 7.0) == 3.0 ? 26.0 : 0.0; });
  ASSERT_THAT(namesOf(d.mean), ElementsAre("column"));
  EXPECT_EQ(d.mean.effects[0].shape.inner[0], 7.0);
  EXPECT_THAT(d.no_readings, IsEmpty()) << "every seventh column is no exception";
}

TEST(Search, FindsWhatOnlyActsTogether) {
  const Discovery d = found(600, 16, [](const MadeRow& row) { return 0.12 * std::exp(-row.time_s / 200.0) * (row.column - 112.0); });
  EXPECT_THAT(namesOf(d.mean), UnorderedElementsAre("time_s", "column"));
  EXPECT_LT(d.unseen.last(), 2.5);
}

TEST(Search, FindsThatTheNoiseGrows) {
  const Discovery d = found(600, 17, [](const MadeRow&) { return 0.0; }, [](const MadeRow& row, double unit) { return unit * std::exp(0.04 * row.ambient_klx); });
  EXPECT_THAT(namesOf(d.spread), ElementsAre("ambient_klx"));
  EXPECT_THAT(d.mean.effects, IsEmpty());
}

TEST(Search, SetsStuckReadingsAsideAndSaysWhatTheirShareGoesWith) {
  const Discovery d = found(600, 18, [](const MadeRow& row) {
    const bool is_stuck = std::fmod(7.0 * row.reference_mm, 60.0) < row.ambient_klx / 3.0;
    return is_stuck ? 10.0 - row.reference_mm : 5.0;
  });
  ASSERT_EQ(d.no_readings.size(), 1U);
  EXPECT_EQ(d.no_readings[0].kind, NoReading::Stuck);
  ASSERT_TRUE(d.share.has_value());
  EXPECT_THAT(namesOf(*d.share), ElementsAre("ambient_klx"));
  EXPECT_THAT(d.mean.effects, IsEmpty());
}

TEST(Search, TakesAStretchOfLinesForASeries) {
  const Discovery d = found(500, 19, [](const MadeRow& row) { return row.number >= 300 ? -40.0 : 0.0; });
  ASSERT_EQ(d.mean.effects.size(), 1U);
  // Time goes with the lines, and a column says more than the order of the lines.
  EXPECT_THAT(namesOf(d.mean), ElementsAre("time_s"));
}

TEST(Search, FindsNothingInErrorsThatWander) {
  int found_in = 0;
  for (std::uint64_t seed = 100; seed < 112; ++seed) {
    double slow = 0.0;
    const Discovery d = found(400, seed, [](const MadeRow&) { return 0.0; }, [&](const MadeRow&, double unit) { return 2.0 * (slow = 0.8 * slow + 0.6 * unit); });
    found_in += d.mean.effects.empty() ? 0 : 1;
  }
  // At one in a hundred tables two of twelve come once in two hundred times.
  EXPECT_LE(found_in, 1) << "seeds 100 to 111";
}

TEST(Search, ToldEffectsAreNotLargerThanTheErrors) {
  const Discovery d = found(400, 20, [](const MadeRow& row) { return 0.01 * row.reference_mm + 4.0 / std::cos(row.incidence_deg * std::numbers::pi / 180.0); });
  const double raw = d.open.evidence.y.maxCoeff() - d.open.evidence.y.minCoeff();
  for (const Effect& effect : d.mean.effects) {
    const Eigen::VectorXd curve = curveOf(d, effect);
    EXPECT_LE(curve.maxCoeff() - curve.minCoeff(), raw) << effect.shape.name();
  }
}

}  // namespace
}  // namespace toftwin::loop
