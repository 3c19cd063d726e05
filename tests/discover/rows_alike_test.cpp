// SPDX-License-Identifier: Apache-2.0
// Rows that err alike although no column says so.
#include <gmock/gmock.h>

#include "calib/discover/rows_alike.h"
#include "calib/discover/table_source.h"
#include "planted.h"

namespace toftwin::discover {
namespace {

TEST(RowsAlike, RowsOfOneLoggedValueAreACaptureOnlyWhereTheyErrAlike) {
  const TableSource alike{plant(4, {Hidden::Nothing}, 0.0, {.logged_mm = 1.0}).data, true};
  EXPECT_EQ(alike.runsOf(), "ambient_klx");
  EXPECT_EQ(alike.captures(), 20u) << "400 rows, one value for 20";
  const TableSource alone{plant(4, {Hidden::Nothing}, 0.0, {.logged_mm = 1e-6}).data, true};
  EXPECT_EQ(alone.runsOf(), "");
}

TEST(RowsAlike, ASettingThatComesBackIsNoCapture) {
  TableData data;
  data.session.assign(80, 0);
  TableCovariate setting{"exposure_us", Nature::Plain, {}, {}}, logged{"ambient_klx", Nature::Plain, {}, {}};
  for (int i = 0; i < 80; ++i) {
    data.error.push_back(0.0);
    setting.values.push_back(i / 5 % 4);
    logged.values.push_back(i / 5);
  }
  data.covariates = {setting, logged};
  const auto runs = runsOfEqualValues(data);
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_EQ(runs[0].covariate, "ambient_klx");
  EXPECT_EQ(runs[0].count, 16);
}

/// (between/2)/(within/2) = (36/2)/(4/2) = 9 for means of 3 and −3 … over runs of equal size.
TEST(RowsAlike, AlikenessIsTheAnalysisOfVariance) {
  const Runs runs{"a", {0, 0, 1, 1}, 2};
  const Eigen::VectorXd residual = (Eigen::VectorXd(4) << 4.0, 2.0, -2.0, -4.0).finished();
  EXPECT_NEAR(alikeness(runs, residual), (9.0 - 1.0) / std::sqrt(2.0 / 2.0 + 2.0 / 2.0), 1e-12);
}

}  // namespace
}  // namespace toftwin::discover
