// SPDX-License-Identifier: Apache-2.0
// From a CSV file to a report.
#include <gmock/gmock.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include "calib/compare/csv.h"
#include "calib/discover/discover_table.h"
#include "planted.h"
#include "protocol/settings/settings.h"

namespace toftwin::discover {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

fs::path folder() {
  const fs::path path = fs::path{testing::TempDir()} / fmt::format("discover-{}", ::getpid());
  fs::create_directories(path);
  return path;
}

fs::path write(const std::string& name, const std::string& text) {
  const fs::path file = folder() / name;
  std::ofstream{file} << text;
  return file;
}

std::string textOf(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream{file}.rdbuf();
  return text.str();
}

/// The planted tables have a gain.
TableMap withReference() {
  TableMap map;
  map.reference = "distance_m";
  return map;
}

TEST(DiscoverTable, WritesAReportAModelAndNumbers) {
  const auto file = write("warm.csv", csvOf(plant(8, {Hidden::WarmUp}, 3000.0).data));
  const auto discovery = discoverTable(file, withReference());
  ASSERT_TRUE(discovery) << discovery.error().message;
  EXPECT_THAT(verdictOf(*discovery), HasSubstr("exponential in time_s"));
  EXPECT_LT(discovery->judged.after.rms, 0.6 * discovery->judged.before.rms);
  EXPECT_GT(discovery->judged.removed, 0.9);
  EXPECT_GE(discovery->judged.removed_high, discovery->judged.removed_low);
  const auto page = writeDiscovery(*discovery, folder() / "out");
  ASSERT_TRUE(page) << page.error().message;
  EXPECT_THAT(textOf(*page), HasSubstr("What the error goes with"));
  EXPECT_THAT(textOf(folder() / "out" / "report.json"), HasSubstr("\"exponential in time_s\""));
  auto model = settings::Table::load(folder() / "out" / "model.toml");
  ASSERT_TRUE(model) << model.error().message;
  ASSERT_EQ(model->tables("effect").size(), 1u);
  auto table = model->tables("effect")[0].table("table");
  ASSERT_TRUE(table);
  EXPECT_EQ(table->numbers("time_s", {-1e9, 1e9}, "", std::nullopt)->size(), 33u);
}

TEST(DiscoverTable, SaysNothingAboveTheNoiseWhereThereIsNothing) {
  const auto discovery =
      discoverTable(write("null.csv", csvOf(plant(9, {Hidden::Nothing}, 0.0).data)), withReference());
  ASSERT_TRUE(discovery) << discovery.error().message;
  EXPECT_THAT(verdictOf(*discovery), HasSubstr("Nothing above the noise"));
  EXPECT_THAT(modelToml(*discovery), testing::Not(HasSubstr("[[effect]]")));
}

/// The locked rows may say anything: what is found is the same, and only the judgement differs.
TEST(DiscoverTable, NeverLooksAtLockedRowsBeforeItIsDone) {
  TableData data = plant(10, {Hidden::Temperature}, 3000.0).data;
  std::string text = csvOf(data), spoilt;
  std::istringstream lines{text};
  std::string line;
  for (int i = -1; std::getline(lines, line); ++i)
    spoilt += line + (i < 0 ? ",locked\n" : i % 5 == 0 ? ",1\n" : ",0\n");
  std::string other = spoilt;
  for (std::size_t at = other.find(",1\n"); at != std::string::npos; at = other.find(",1\n", at + 1)) {
    const std::size_t begin = other.rfind('\n', at) + 1;
    other.insert(begin, "99");
    at += 2;
  }
  const auto a = discoverTable(write("a.csv", spoilt), withReference()),
             b = discoverTable(write("b.csv", other), withReference());
  ASSERT_TRUE(a && b);
  ASSERT_FALSE(a->finding.effects.empty());
  EXPECT_EQ(a->finding.effects[0].coefficient, b->finding.effects[0].coefficient);
  EXPECT_NE(a->judged.sha256, b->judged.sha256);
  EXPECT_GT(b->judged.after.rms, 10.0 * a->judged.after.rms);
}

TEST(TableMap, SaysUnknownKeysAndDoubleMeanings) {
  EXPECT_THAT(loadTableMap(write("a.toml", "mesured = 'a'\n")).error().message, HasSubstr("mesured"));
  EXPECT_THAT(loadTableMap(write("b.toml", "measured = 'a'\nerror = 'b'\n")).error().message,
              HasSubstr("say it one way"));
  EXPECT_THAT(loadTableMap(write("c.toml", "[[covariate]]\nnature = 'time'\n")).error().message,
              HasSubstr("needs `column`"));
}

TEST(TableMap, IsTheTableInTheDocumentation) {
  EXPECT_THAT(textOf(TOFTWIN_SOURCE_DIR "/docs/discover.md"),
              HasSubstr("<!-- map: generated -->\n" + documentTableMap() + "<!-- end -->\n"));
}

/// Measured by a Kinect v2 while it warmed up. Found on four fifths of the rows, judged on the fifth.
TEST(RealData, TheKinectsWarmUpGoesWithTime) {
  const auto data = compare::findThesisData();
  if (!data) GTEST_SKIP() << "no tof-thesis-2018 in $TOFTWIN_DATA or ../shared/data";
  const auto discovery = discoverTable(*data / "warmup_drift" / "kinect_v2.csv", {});
  ASSERT_TRUE(discovery) << discovery.error().message;
  ASSERT_FALSE(discovery->finding.effects.empty());
  EXPECT_EQ(discovery->finding.effects[0].covariates, std::vector<std::string>{"time_s"});
  EXPECT_LT(discovery->judged.after.rms, discovery->judged.before.rms);
}

}  // namespace
}  // namespace toftwin::discover
