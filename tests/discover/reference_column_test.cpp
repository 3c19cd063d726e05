// SPDX-License-Identifier: Apache-2.0
// A reference that no header names, and one in another unit than its header says.
#include <gmock/gmock.h>

#include <cmath>

#include <fmt/format.h>

#include "calib/discover/table_data.h"

namespace toftwin::discover {
namespace {

using testing::Contains;
using testing::HasSubstr;

Result<TableData> readTargets(const std::string& text, const TableMap& map = {}) {
  const auto table = parseCsv(text, "t.csv");
  return table ? readTable(*table, map, "t.csv") : Result<TableData>{table.error()};
}

/// Targets at 1 to 3 m in another order than time's, ranges 3 mm too long with an error of 2 mm.
std::string targets(const std::string& header, double units_per_metre, double more_per_metre = 0.0) {
  std::string text = header + ",measured_mm,t_s\n";
  for (int i = 0; i < 60; ++i) {
    const double metres = 1.0 + 0.05 * (i * 17 % 41);
    text += fmt::format("{:.4f},{:.2f},{}\n", metres * units_per_metre,
                        metres * (1000.0 + more_per_metre) + 3.0 + 2.0 * std::sin(1.7 * i), i);
  }
  return text;
}

TEST(ReferenceColumn, IsTheTargetThatGoesOneToOne) {
  for (const auto& [header, units] :
       {std::pair{"target_m", 1.0}, {"plane_mm", 1000.0}, {"distance_cm", 100.0}, {"Wand [mm]", 1000.0}}) {
    const auto data = readTargets(targets(header, units));
    ASSERT_TRUE(data) << data.error().message;
    EXPECT_EQ(data->reference_name, header);
    EXPECT_NEAR(data->error[0], 3.0, 0.1) << header;
    EXPECT_THAT(data->notes, Contains(HasSubstr(fmt::format("{} goes with measured_mm one to one", header))));
  }
}

TEST(ReferenceColumn, IsNoneThatGoesOtherwiseOrIsSaidToBeNone) {
  EXPECT_EQ(readTargets(targets("target_m", 1.0, 100.0))->reference_name, "") << "a slope of 1.1";
  TableMap map;
  map.covariates = {{"target_m"}, {"t_s"}};
  EXPECT_EQ(readTargets(targets("target_m", 1.0), map)->reference_name, "");
  EXPECT_EQ(readTargets(targets("voltage", 1.0))->reference_name, "");
}

TEST(ReferenceColumn, IsAskedForWhereThereAreTwo) {
  std::string text = "target_m,wall_mm,measured_mm,t_s\n";
  for (int i = 0; i < 60; ++i)
    text += fmt::format("{},{},{},{}\n", 1.0 + 0.05 * i, 1000 + 50 * i, 1003.0 + 50 * i + std::sin(1.7 * i), i);
  EXPECT_THAT(readTargets(text).error().message,
              HasSubstr("which column is the reference of measured_mm: target_m, wall_mm?"));
}

/// 1000 for each 1: a gain of 999 would hide it.
TEST(ReferenceColumn, InAnotherUnitThanItsHeaderSaysIsAnError) {
  EXPECT_THAT(readTargets(targets("reference", 1.0)).error().message,
              testing::ContainsRegex("measured_mm changes by (1000|999.?|1001) for each 1 of reference: they are in "
                                     "other units"));
  EXPECT_THAT(readTargets(targets("reference_mm", 1.0)).error().message,
              HasSubstr("for each 1 of reference_mm: one of the headers ends in the wrong unit"));
  EXPECT_TRUE(readTargets(targets("reference_m", 1.0)));
  EXPECT_TRUE(readTargets(targets("reference_m", 1.0, 300.0))) << "a gain";
}

/// Of a column that only its word makes the reference, too.
TEST(ReferenceColumn, AGuessedOneInOtherUnitsIsAnError) {
  EXPECT_THAT(readTargets(targets("laser_mm", 1.0)).error().message,
              HasSubstr("for each 1 of laser_mm: one of the headers ends in the wrong unit"));
  for (const auto& [header, units] : {std::pair{"laser", 1.0}, {"laser_in", 1.0 / 0.0254}, {"target_cm", 1.0 / 0.3048}})
    EXPECT_THAT(readTargets(targets(header, units)).error().message, HasSubstr("changes by")) << header;
  EXPECT_TRUE(readTargets(targets("target_number", 20.0))) << "50 mm for each";
}

TEST(ReferenceColumn, LengthsThatAreTextAreAnError) {
  std::string text = "laser_mm,measured_mm,t_s\n";
  for (int i = 0; i < 60; ++i) text += fmt::format("\"{},{:03}.0\",{},{}\n", 1 + i % 3, i * 16, 1003.0 + i, i);
  EXPECT_THAT(readTargets(text).error().message, HasSubstr("\"1,000.0\" in column \"laser_mm\" is not a number"));
}

}  // namespace
}  // namespace toftwin::discover
