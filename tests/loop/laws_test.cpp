// SPDX-License-Identifier: Apache-2.0
// What is said of a table does not depend on how it is written.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/loop/laws.h"
#include "tests/loop/made_table.h"

namespace toftwin::testing {
namespace {

class LawsOfTables : public ::testing::TestWithParam<std::size_t> {};

TEST_P(LawsOfTables, AWaveAndAStepAreSaidWhateverTheTableLooksLike) {
  const std::string csv = madeCsv(400, 41, [](const MadeRow& row) {
    return 12.0 + 4.0 * std::sin(2.0 * std::numbers::pi * row.reference_mm / 700.0) + (row.ambient_klx > 35.0 ? 6.0 : 0.0);
  });
  const Law& law = laws()[GetParam()];
  EXPECT_EQ(verdictOf(csvOf(law.changed(parsedTable(csv), 1))), verdictOf(csv)) << law.name;
}
TEST_P(LawsOfTables, OffsetAndGainAreSaidWhateverTheTableLooksLike) {
  const std::string csv = madeCsv(300, 42, [](const MadeRow& row) { return 25.0 - 0.03 * row.reference_mm; });
  const Law& law = laws()[GetParam()];
  EXPECT_EQ(verdictOf(csvOf(law.changed(parsedTable(csv), 2))), verdictOf(csv)) << law.name;
}

std::string nameOf(const ::testing::TestParamInfo<std::size_t>& info) {
  std::string name{laws()[info.param].name};
  for (char& c : name) c = c == ' ' ? '_' : c;
  return name;
}
INSTANTIATE_TEST_SUITE_P(Each, LawsOfTables, ::testing::Range(std::size_t{0}, std::size_t{11}), nameOf);

}  // namespace
}  // namespace toftwin::testing
