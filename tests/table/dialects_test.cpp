// SPDX-License-Identifier: Apache-2.0
// One small table in many dialects: the same numbers come out of each.
#include "dialects.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "calib/table/readings.h"

namespace toftwin::table {
namespace {

const Column* columnOf(const Readings& readings, Nature nature, std::string_view unit) {
  const auto at = std::ranges::find_if(
      readings.covariates, [&](const Column& one) { return one.nature == nature && one.unit == unit; });
  return at == readings.covariates.end() ? nullptr : &*at;
}

TEST(Dialects, AllGiveTheSameNumbers) {
  const auto rows = smallTable();
  EXPECT_GE(dialects().size(), 40u);
  for (const Dialect& dialect : dialects()) {
    SCOPED_TRACE(dialect.name);
    const auto read = parseReadings(dialect.bytes, {}, "t.csv");
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_GE(read->rows(), rows.size());
    const Column* time = columnOf(*read, Nature::Time, "s");
    const Column* temperature = columnOf(*read, Nature::Number, "degC");
    ASSERT_TRUE(time != nullptr && temperature != nullptr);
    EXPECT_EQ(read->covariates.size(), 2u);
    EXPECT_EQ(read->unit, "mm");
    for (std::size_t i = 0; i < rows.size(); ++i) {
      EXPECT_NEAR(read->reference[i], rows[i].reference_mm, 1e-9);
      EXPECT_NEAR(read->measured[i], rows[i].measured_mm, 1e-9);
      EXPECT_NEAR(temperature->values[i], rows[i].temperature_c, 1e-9);
      EXPECT_NEAR(time->values[i], rows[i].time_s, 1e-3) << "of a spreadsheet's days, ten digits";
    }
  }
}

TEST(Dialects, OfWhichARowIsMissingHaveNoNumberThere) {
  for (const Dialect& dialect : dialects()) {
    const auto read = parseReadings(dialect.bytes, {}, "t.csv");
    ASSERT_TRUE(read);
    EXPECT_EQ(read->rows() == 61, dialect.name == "a missing value") << dialect.name;
    EXPECT_EQ(read->aside.size(),
              dialect.name == "sums at the end" || dialect.name == "a total that is called one" ? 1u : 0u)
        << dialect.name;
  }
}

}  // namespace
}  // namespace toftwin::table
