// SPDX-License-Identifier: Apache-2.0
// The written model: read again, applied, refused.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "calib/loop/correct.h"
#include "calib/loop/discover.h"
#include "tests/loop/made_table.h"

namespace toftwin::loop {
namespace {

using testing::MadeRow;
using ::testing::HasSubstr;

double wavyError(const MadeRow& row) {
  return 20.0 + 0.02 * row.reference_mm + 6.0 * std::sin(2.0 * std::numbers::pi * row.column / 50.0) + (std::fmod(row.column, 4.0) == 1.0 ? 8.0 : 0.0);
}
Discovery wavy() {
  auto discovery = discover(testing::madeReadings(600, 31, wavyError), {});
  EXPECT_TRUE(discovery.ok());
  return *std::move(discovery);
}

TEST(Model, ReadsBackToTheSamePrediction) {
  const Discovery d = wavy();
  const auto read = parseModel(toToml(d.model), "model.toml");
  ASSERT_TRUE(read.ok()) << read.error().message;
  const Eigen::VectorXd before = predicted(d.open.evidence, termsOf(d.model)), after = predicted(d.open.evidence, termsOf(*read));
  EXPECT_EQ((before - after).cwiseAbs().maxCoeff(), 0.0);
}

TEST(Model, PredictsWhatTheSearchDid) {
  // Hats become one curve in the file: the same straight lines, to rounding of numbers of a few thousand.
  const Discovery d = wavy();
  Eigen::VectorXd searched = Eigen::VectorXd::Zero(d.open.evidence.rows());
  for (const Effect& effect : d.mean.effects) searched += columnsOf(d.open.evidence, effect.shape.columns) * effect.coefficient;
  Eigen::VectorXd written = predicted(d.open.evidence, termsOf(d.model));
  for (const LearnedEffect& effect : d.model.effects)
    if (effect.role == "constant") written.array() -= effect.terms[0].coefficient;
  EXPECT_LT((searched - written).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Correct, TakesEverythingOffATableThatItHasNotSeen) {
  const Discovery d = wavy();
  const auto corrected = correctTable(testing::madeReadings(500, 32, wavyError), d.model);
  ASSERT_TRUE(corrected.ok()) << corrected.error().message;
  EXPECT_GT(corrected->rms_before, 60.0);
  // 2 mm of noise, and what 480 rows leave unknown of some twenty numbers: 2 √(1 + 20/480) mm; four errors of a deviation of 500 rows.
  EXPECT_LT(corrected->rms_after, 2.04 * (1.0 + 4.0 / std::sqrt(1000.0)));
  EXPECT_EQ(corrected->ladder.steps.front().name, "raw");
  EXPECT_EQ(corrected->ladder.steps.back().name, "effects");
}

TEST(Correct, NeedsNoReference) {
  const Discovery d = wavy();
  table::Readings readings = testing::madeReadings(300, 33, wavyError);
  const std::vector<double> truth = readings.reference;
  readings.reference.clear(), readings.reference_name.clear();
  readings.error = readings.measured;
  const TableEvidence table = evidenceOf(readings);
  const auto value = corrected(table, readings, d.model, termsOf(d.model));
  ASSERT_TRUE(value.ok()) << value.error().message;
  double squares = 0.0;
  for (Eigen::Index i = 0; i < value->size(); ++i) squares += std::pow((*value)[i] - truth[static_cast<std::size_t>(i)], 2);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(value->size())), 2.4);
}

TEST(Correct, SolvesForTheCorrectedValue) {
  const auto model = parseModel("unit = \"mm\"\n[[effect]]\ntype = \"learned\"\nterms = [\"range_mm += 10\", \"range_mm += -0.23 * range_mm\", \"range_mm += 4 * sine(range_mm, 900)\"]\n", "m.toml");
  ASSERT_TRUE(model.ok()) << model.error().message;
  const auto exact = [](const MadeRow& row) { return 10.0 - 0.23 * row.reference_mm + 4.0 * std::sin(2.0 * std::numbers::pi * row.reference_mm / 900.0); };
  const auto corrected = correctTable(testing::madeReadings(100, 34, exact, [](const MadeRow&, double) { return 0.0; }), *model);
  ASSERT_TRUE(corrected.ok()) << corrected.error().message;
  EXPECT_LT(corrected->rms_after, 1e-3);  // the table is written to 0.0001 mm
}

TEST(Correct, RefusesAColumnThatIsNotThereByName) {
  const auto model = parseModel("unit = \"mm\"\n[[effect]]\ntype = \"learned\"\nterms = [\"range_mm += 0.5 * humidity\"]\n", "m.toml");
  ASSERT_TRUE(model.ok());
  const auto corrected = correctTable(testing::madeReadings(50, 35, wavyError), *model);
  ASSERT_FALSE(corrected.ok());
  EXPECT_THAT(corrected.error().message, HasSubstr("'humidity'"));
}

TEST(Correct, RefusesAnotherUnit) {
  const auto model = parseModel("unit = \"degC\"\n[[effect]]\ntype = \"learned\"\nterms = [\"value += 0.5\"]\n", "m.toml");
  ASSERT_TRUE(model.ok());
  const auto corrected = correctTable(testing::madeReadings(50, 36, wavyError), *model);
  ASSERT_FALSE(corrected.ok());
  EXPECT_THAT(corrected.error().message, HasSubstr("degC"));
}

TEST(Model, WithoutEffectsIsNone) {
  const auto model = parseModel("unit = \"mm\"\n", "m.toml");
  ASSERT_FALSE(model.ok());
  EXPECT_THAT(model.error().message, HasSubstr("[[effect]]"));
}

}  // namespace
}  // namespace toftwin::loop
