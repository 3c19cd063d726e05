// SPDX-License-Identifier: Apache-2.0
// Tables that a model is applied to: their units, their references, their lines.
#include <gmock/gmock.h>

#include <cmath>

#include <fmt/format.h>

#include "calib/loop/correct.h"
#include "calib/loop/discover.h"

namespace toftwin::loop {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

Model modelOf(const std::string& terms, const std::string& more = {}) {
  auto model = parseModel("unit = \"mm\"\n" + more + "[[effect]]\ntype = \"learned\"\nterms = [" + terms + "]\n" +
                              "[[rung]]\nname = \"constant\"\nterms = [\"range_mm += 3\"]\n[[rung]]\nname = \"gain\"\nterms = [\"range_mm += 0.01 * range_mm\"]\n", "m.toml");
  EXPECT_TRUE(model.ok()) << model.error().message;
  return *std::move(model);
}
table::Readings readingsOf(const std::string& csv, const std::string& name = "t.csv") {
  auto readings = table::parseReadings(csv, {}, name);
  EXPECT_TRUE(readings.ok()) << readings.error().message;
  return *std::move(readings);
}
/// In metres and minutes, with an error of 40 mm and 0.5 mm a minute.
std::string inMetres(const std::string& header = "wall_m,depth_m,time_min") {
  std::string csv = header + "\n";
  for (int i = 0; i < 40; ++i) {
    const double wall_m = 0.6 + 0.083 * ((i * 7) % 40), minutes = 0.5 * i;
    csv += fmt::format("{:.6f},{:.6f},{}\n", wall_m, wall_m + 0.04 + 0.0005 * minutes, minutes);
  }
  return csv;
}
constexpr const char* kTerms = "\"range_mm += 40\", \"range_mm += 0.00833333333333 * time_min\"";  // a time is in seconds

TEST(CorrectedTable, IsWrittenInTheUnitsOfItsHeaders) {
  const table::Readings readings = readingsOf(inMetres());
  const auto corrected = correctTable(readings, modelOf(kTerms));
  ASSERT_TRUE(corrected.ok()) << corrected.error().message;
  EXPECT_LT(corrected->rms_after, 1e-2);
  EXPECT_THAT(corrected->csv, StartsWith("time_min,wall_m,depth_m,corrected_m\n0,0.6,0.64,0.6"));
  // Read again it says what it said.
  const table::Readings again = readingsOf(corrected->csv, "again.csv");
  ASSERT_EQ(again.reference.size(), readings.reference.size());
  for (std::size_t i = 0; i < readings.rows(); ++i) {
    EXPECT_NEAR(again.reference[i], readings.reference[i], 1e-6);
    EXPECT_NEAR(again.covariates[0].values[i], readings.covariates[0].values[i], 1e-6);
  }
}

TEST(CorrectedTable, HasARowOfUnitsInItsHeaders) {
  std::string csv = inMetres("wall,depth,elapsed time");
  csv.insert(csv.find('\n') + 1, "m,m,min\n");
  auto model = modelOf("\"range_mm += 40\", \"range_mm += 0.00833333333333 * 'elapsed time'\"");
  const auto corrected = correctTable(readingsOf(csv), model);
  ASSERT_TRUE(corrected.ok()) << corrected.error().message;
  EXPECT_THAT(corrected->csv, StartsWith("elapsed time [min],wall [m],depth [m],corrected_m\n0,0.6,0.64,0.6"));
}

TEST(CorrectedTable, OfErrorsOfTheOtherSignKeepsTheirSign) {
  std::string csv = "reference_m,reference_minus_measured_m\n";
  for (int i = 0; i < 40; ++i) csv += fmt::format("{},{}\n", 0.6 + 0.05 * i, -0.04);
  const auto corrected = correctTable(readingsOf(csv), modelOf("\"range_mm += 39\""));
  ASSERT_TRUE(corrected.ok()) << corrected.error().message;
  EXPECT_THAT(corrected->csv, StartsWith("reference_m,reference_minus_measured_m,error_left_m\n0.6,-0.04,0.001\n"));
}

TEST(CorrectedTable, WithoutAReferenceSaysNothingOfWhatOnlyOneTells) {
  std::string csv = "depth_mm,time_s\n";
  for (int i = 0; i < 60; ++i) csv += fmt::format("{},{}\n", 1500.0 + 6.0 * std::exp(-i / 20.0), i);
  const auto corrected = correctTable(readingsOf(csv), modelOf("\"range_mm += 0.002 * range_mm\", \"range_mm += 6 * decay(time_s, 20)\""));
  ASSERT_TRUE(corrected.ok()) << corrected.error().message;
  ASSERT_EQ(corrected->ladder.steps.size(), 1U);
  EXPECT_EQ(corrected->ladder.steps[0].name, "raw");
  EXPECT_THAT(corrected->notes, Contains(HasSubstr("no reference")));
  EXPECT_LT(corrected->rms_after, 0.01);
}

/// Lines of a file say nothing of another file.
TEST(CorrectedTable, OfAnotherFileLosesWhatGoesWithTheLine) {
  const auto csv = [](double more) {
    std::string text = "reference_mm,measured_mm\n";
    for (int i = 0; i < 60; ++i) text += fmt::format("{},{}\n", 700.0 + 50.0 * i, 700.0 + 50.0 * i + more + (i >= 30 ? 20.0 : 0.0));
    return text;
  };
  const table::Readings own = readingsOf(csv(3.0)), other = readingsOf(csv(3.5), "other.csv");
  const Model model = modelOf("\"range_mm += 3\", \"range_mm += 20 * step(file_line, 31.5)\"", fmt::format("data = \"t.csv\"\ndata_id = \"{}\"\n", dataIdOf(own)));
  const auto of_own = correctTable(own, model), of_other = correctTable(other, model);
  ASSERT_TRUE(of_own.ok() && of_other.ok());
  EXPECT_NEAR(of_own->rms_after, 0.0, 1e-9);
  EXPECT_NEAR(of_other->rms_after, std::sqrt(0.5 * (0.5 * 0.5 + 20.5 * 20.5)), 1e-9);
  EXPECT_THAT(of_other->notes, Contains(::testing::AllOf(HasSubstr("step(file_line, 31.5)"), HasSubstr("t.csv"))));
}

TEST(CorrectedTable, OfTheTableThatTheModelWasFoundInKeepsWhatGoesWithTheLine) {
  const auto read = parseModel(toToml(modelOf("\"range_mm += 1\"", "data_id = \"0123\"\n")), "m.toml");
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->data_id, "0123");
}

}  // namespace
}  // namespace toftwin::loop
