// SPDX-License-Identifier: Apache-2.0
// Tables of measured scan lines and series, judged by the traits that a run's frames are judged by.
#include "calib/compare/table_traits.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>

#include "calib/compare/csv.h"
#include "tests/record/record_testing.h"

namespace toftwin::compare {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

class Table : public testing::Test {
 protected:
  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream{folder_ / name} << text;
    return folder_ / name;
  }
  static const Trait* find(const NamedTraits& all, const std::string& of, const std::string& name) {
    for (const NamedTrait& one : all.traits) {
      if (one.of == of && one.trait.name == name) return &one.trait;
    }
    return nullptr;
  }
  record::Folder folder_;
};

/// 10 mm, then 3 mm less after a warm-up with 200 s; times in minutes would have no unit of ours, these are
/// in ms.
std::string driftOf(double depth_mm) {
  std::string text = "t_ms,too_near_mm\n";
  for (int i = 0; i < 120; ++i)
    text += fmt::format("{},{:.6f}\n", 10'000 * i,
                        -(10.0 + depth_mm * std::exp(-10.0 * i / 200.0) + (i % 2 == 0 ? 0.01 : -0.01)));
  return text;
}

TEST_F(Table, ConvertsItsColumnsUnitsAndSigns) {
  const auto table =
      loadTable({.file = write("a.csv", driftOf(3.0)), .kind = "drift", .columns = {"t_ms", "-too_near_mm"}});
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_DOUBLE_EQ(table->values[0][2], 20.0);
  EXPECT_NEAR(table->values[1][0], 13.01, 1e-9);
  TraitCollector all;
  addTraits(*table, {}, "A", all);
  const NamedTraits found = std::move(all).found();
  const Trait* tau = find(found, "A", "time constant");
  ASSERT_NE(tau, nullptr);
  EXPECT_LT(tau->low, 200.0);
  EXPECT_GT(tau->high, 200.0);
}

TEST_F(Table, TwoAreHeldAgainstEachOther) {
  const TableJob a{
      .file = write("a.csv", driftOf(3.0)), .kind = "drift", .columns = {"t_ms", "-too_near_mm"}};
  TableJob b = a;
  b.file = write("b.csv", driftOf(5.0));
  const auto same = judgeTables({a, a}), other = judgeTables({a, b});
  ASSERT_TRUE(same && other);
  EXPECT_THAT(same->verdict, HasSubstr("In none of 2 numbers"));
  EXPECT_THAT(other->verdict, HasSubstr("1 of 2 numbers of B differ"));
  EXPECT_THAT(other->verdict, HasSubstr("Largest difference: drift, −1.99 mm"))
      << "2 mm, of which e^(−1190/200) is still to come";
  EXPECT_THAT(toHtml(*other), testing::AllOf(HasSubstr("A: one exponential"), HasSubstr("B: one exponential"),
                                             HasSubstr("B − A [mm]")));
}

TEST_F(Table, OfEveryKindSaysWhatItLacks) {
  const fs::path file = write("a.csv", "bird\n1\n");
  for (const TableKind& kind : tableKinds()) {
    const auto refused = loadTable({.file = file, .kind = kind.name, .frequency_hz = {20e6}});
    ASSERT_FALSE(refused) << kind.name;
    EXPECT_THAT(refused.error().message,
                HasSubstr(fmt::format("has no column \"{}\"", kind.columns.front())));
  }
  const auto refusal = [&](const TableJob& job) { return loadTable(job).error().message; };
  EXPECT_THAT(refusal({.file = file, .kind = "harmonics"}), HasSubstr("--frequency-mhz"));
  EXPECT_THAT(refusal({.file = file, .kind = "song"}), HasSubstr("no kind of table \"song\""));
  EXPECT_THAT(refusal({.file = file, .kind = "drift", .columns = {"bird"}}), HasSubstr("takes 2 columns"));
  EXPECT_THAT(refusal({.file = file, .kind = "drift", .columns = {"bird_mm", "bird"}}),
              HasSubstr("unit is of another quantity"));
}

/// A kind that no code stands behind would throw.
TEST_F(Table, OfEveryKindIsJudged) {
  std::string text = "a,b,c,d\n";
  for (int i = 1; i < 60; ++i)
    text += fmt::format("{},{},{},{}\n", i, 1.0 + 0.01 * (i % 7), 0.5 + 0.1 * (i % 3), 2.0 + 0.01 * (i % 5));
  const fs::path file = write("a.csv", text);
  for (const TableKind& kind : tableKinds()) {
    std::vector<std::string> columns{"a", "b", "c", "d"};
    columns.resize(kind.columns.size());
    const auto table =
        loadTable({.file = file, .kind = kind.name, .columns = columns, .frequency_hz = {20e6}});
    ASSERT_TRUE(table) << table.error().message;
    TraitCollector all;
    addTraits(*table, {20e6}, "A", all);
    const NamedTraits found = std::move(all).found();
    EXPECT_NE(found.traits.empty(), found.untold.empty()) << kind.name;
  }
}

/// Lines that step from 1 m to 2 m; a pixel hangs between in three of four.
TEST_F(Table, OfScanLinesTellsFlyingPixels) {
  std::string text = "line,range_mm\n";
  for (int line = 0; line < 40; ++line) {
    for (int x = 0; x < 16; ++x)
      text += fmt::format("{},{}\n", line, x < 8 ? 1000 : x == 8 && line % 4 != 0 ? 1400 : 2000);
  }
  const auto report = judgeTables(
      {{.file = write("lines.csv", text), .kind = "flying_pixels", .columns = {"line", "range_mm"}}});
  ASSERT_TRUE(report) << report.error().message;
  const Json* rows = report->data.find("characteristics")->find("rows");
  EXPECT_DOUBLE_EQ(rows->at(0).find("value")->number(), 0.75);
}

/// 3 m of the 9.37 m of 16 MHz.
TEST_F(Table, SaysInItsWordsWhichWavesItsDistancesAreTooShortFor) {
  std::string text = "distance_m,error_mm\n";
  for (int i = 0; i < 120; ++i) text += fmt::format("{},{}\n", 0.5 + 0.0252 * i, i % 3 - 1);
  const auto report = judgeTables({{.file = write("errors.csv", text),
                                    .kind = "harmonics",
                                    .columns = {"distance_m", "error_mm"},
                                    .frequency_hz = {16e6}}});
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_THAT(toMarkdown(*report),
              testing::ContainsRegex("What these tables cannot tell \\(1\\):\n\n- harmonics of A: "
                                     "waves of .*1 per period are not told.* 0.32 of the period of 16 MHz, "
                                     "9.37 m; up to 9.87 m"));
}

/// The thesis' series of a Kinect v2 that warms up: by nearly four millimetres, as its README says.
TEST_F(Table, OfAPublishedSeriesTellsItsDrift) {
  const auto data = findThesisData();
  if (!data) GTEST_SKIP() << "no tof-thesis-2018 in $TOFTWIN_DATA or ../shared/data";
  const auto report = judgeTables({{.file = *data / "warmup_drift" / "kinect_v2.csv",
                                    .kind = "drift",
                                    .columns = {"time_s", "depth_mm"}}});
  ASSERT_TRUE(report) << report.error().message;
  const Json& drift = report->data.find("characteristics")->find("rows")->at(0);
  EXPECT_EQ(drift.find("name")->words(), "drift");
  EXPECT_NEAR(drift.find("value")->number(), 3.8, 1.5) << "first to last reading, not minutes' means";
}

}  // namespace
}  // namespace toftwin::compare
