// SPDX-License-Identifier: Apache-2.0
// From a CSV file to a report.
#include <gmock/gmock.h>

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include <fmt/format.h>

#include "calib/compare/csv.h"
#include "calib/discover/curve.h"
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
  const auto times = *table->numbers("time_s", {-1e9, 1e9}, "", std::nullopt);
  EXPECT_TRUE(std::ranges::is_sorted(times));
  EXPECT_GE(times.size(), 17u);
}

/// Small amplitudes are many and near each other: the table has every corner of the curve, and 0 is its mean
/// over the rows.
TEST(DiscoverTable, WritesATableThatBendsWhereTheCurveDoes) {
  Planted planted = plant(12, {Hidden::Nothing}, 0.0);
  const auto& amplitude =
      std::ranges::find(planted.data.covariates, "amplitude", &TableCovariate::name)->values;
  for (std::size_t i = 0; i < planted.data.rows(); ++i)
    planted.data.error[i] += 4.0 * std::sin(3.0 * std::log(amplitude[i]));
  const auto discovery = discoverTable(write("skewed.csv", csvOf(planted.data)), withReference());
  ASSERT_TRUE(discovery) << discovery.error().message;
  ASSERT_EQ(discovery->finding.effects.size(), 1u) << verdictOf(*discovery);
  const Effect& effect = discovery->finding.effects[0];
  ASSERT_FALSE(isFormula(effect)) << effect.name;
  const auto file = write("skewed.toml", modelToml(*discovery));
  auto model = settings::Table::load(file);
  ASSERT_TRUE(model) << model.error().message;
  const auto points =
      *model->tables("effect")[0].table("table")->numbers("amplitude", {-1e9, 1e9}, "", std::nullopt);
  for (const Term& term : termsOf(effect))
    for (const double knot : term.factors[0].numbers)
      EXPECT_THAT(points, testing::Contains(testing::DoubleNear(knot, 1e-6 * knot))) << inWords(term);
  const Level level = levelOf(effect, discovery->open);
  double sum = 0.0, smallest_error = 1e9;
  for (const double x :
       std::ranges::find(discovery->open.covariates, "amplitude", &TableCovariate::name)->values) {
    sum += effectAt(effect, {{"amplitude", x}}, level).value;
    smallest_error = std::min(smallest_error, effectAt(effect, {{"amplitude", x}}, level).error);
  }
  EXPECT_NEAR(sum / static_cast<double>(discovery->open.rows()), 0.0, 1e-9);
  EXPECT_LT(smallest_error, effectAt(effect, {{"amplitude", 100.0}}).error)
      << "beside zero it has the offset's error";
}

/// Six rows are a metre off whatever is known: they are in the RMSE, not in the share.
TEST(DiscoverTable, JudgesTheShareWithoutRowsThatAreFarOffBeforeAndAfter) {
  const std::string text = csvOf(plant(13, {Hidden::WarmUp}, 3000.0).data);
  std::istringstream lines{text};
  std::string line, plain, bumped;
  for (int i = -1; std::getline(lines, line); ++i) {
    const std::string end = i < 0 ? ",locked\n" : i % 5 == 0 ? ",1\n" : ",0\n";
    plain += line + end;
    const bool is_bumped = i >= 0 && i % 75 == 0;
    bumped += (is_bumped ? fmt::format("1000{}", line.substr(line.find(','))) : line) + end;
  }
  const auto a = discoverTable(write("plain.csv", plain), withReference()),
             b = discoverTable(write("bumped.csv", bumped), withReference());
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->judged.far_off, 0u);
  EXPECT_EQ(b->judged.far_off, 6u);
  EXPECT_GT(b->judged.after.rms, 100.0);
  EXPECT_TRUE(b->judged.isTelling());
  EXPECT_NEAR(b->judged.removed, a->judged.removed, a->judged.removed_high - a->judged.removed_low);
}

/// The offset of a session that nothing was fitted to is its own: one row in fifty that is a metre off would
/// make it 20 mm, if it were a mean.
TEST(DiscoverTable, AFarRowOfAnUnseenSessionDoesNotShiftTheOthers) {
  const std::string text = csvOf(plant(17, {Hidden::WarmUp}, 3000.0, {.sessions = 8}).data);
  std::istringstream lines{text};
  std::string line, plain, bumped;
  for (int i = -1; std::getline(lines, line); ++i) {
    const bool is_locked = i >= 300;  // two sessions
    const std::string end = i < 0 ? ",locked\n" : is_locked ? ",1\n" : ",0\n";
    plain += line + end;
    bumped += (is_locked && i % 50 == 7 ? fmt::format("1000{}", line.substr(line.find(','))) : line) + end;
  }
  const auto a = discoverTable(write("sessions.csv", plain), withReference()),
             b = discoverTable(write("bumped_sessions.csv", bumped), withReference());
  ASSERT_TRUE(a && b);
  ASSERT_EQ(a->judged.rows, 100u);
  EXPECT_EQ(a->judged.far_off, 0u);
  EXPECT_EQ(b->judged.far_off, 2u);
  EXPECT_NEAR(b->judged.removed, a->judged.removed, a->judged.removed_high - a->judged.removed_low);
}

TEST(DiscoverTable, SaysHowLargeAnEffectIsAndBetweenWhichSettingsItSteps) {
  Planted planted = plant(14, {Hidden::Nothing}, 0.0);
  const auto& exposure =
      std::ranges::find(planted.data.covariates, "exposure_us", &TableCovariate::name)->values;
  for (std::size_t i = 0; i < planted.data.rows(); ++i)
    planted.data.error[i] += exposure[i] >= 1000.0 ? 6.0 : 0.0;
  const auto discovery = discoverTable(write("step.csv", csvOf(planted.data)), withReference());
  ASSERT_TRUE(discovery) << discovery.error().message;
  ASSERT_EQ(discovery->finding.effects.size(), 1u) << verdictOf(*discovery);
  ASSERT_EQ(discovery->finding.effects[0].name, "step in exposure_us");
  const auto step = stepRows(discovery->open, discovery->finding.effects[0], 1);
  ASSERT_TRUE(step);
  EXPECT_EQ(step->covariate, "exposure_us");
  EXPECT_EQ(std::pair(step->below, step->from), (std::pair{500.0, 1000.0}));
  EXPECT_FALSE(stepRows(discovery->open, discovery->finding.effects[0], 0)) << "its height is no place";
  const auto sizes = effectIn(discovery->open, discovery->finding.effects[0]);
  EXPECT_NEAR(std::ranges::max(sizes) - std::ranges::min(sizes), 6.0, 4.0 * 2.0 / std::sqrt(400.0));
  EXPECT_THAT(verdictOf(*discovery), testing::ContainsRegex("by up to [56]\\.[0-9]+ mm"));
  EXPECT_THAT(verdictOf(*discovery), HasSubstr("step in exposure_us between 500 and 1000"));
}

TEST(DiscoverTable, TellsTheDateOfAStep) {
  const Planted planted = plant(16, {Hidden::Nothing}, 0.0, {.session_mm = 0.0});
  std::string text = "when,error_mm\n";
  for (std::size_t i = 0; i < planted.data.rows(); ++i)
    text += fmt::format("2026-05-{:02}T{:02}:30:00Z,{}\n", 1 + i / 24, i % 24,
                        planted.data.error[i] - 2.0 * planted.data.reference[i] + (i >= 240 ? 6.0 : 0.0));
  const auto discovery = discoverTable(write("dated.csv", text), {});
  ASSERT_TRUE(discovery) << discovery.error().message;
  EXPECT_THAT(verdictOf(*discovery),
              testing::ContainsRegex("step in when between 2026-05-1[01] [0-9:]+ and 2026-05-1[01]"));
}

TEST(DiscoverTable, CallsOffsetsByTheirSessions) {
  const auto discovery =
      discoverTable(write("sessions.csv", csvOf(plant(15, {Hidden::Nothing}, 0.0).data)), withReference());
  ASSERT_TRUE(discovery) << discovery.error().message;
  std::vector<std::string> names;
  for (const Estimate& one : namedNuisances(*discovery)) names.push_back(one.name);
  EXPECT_THAT(names, testing::ElementsAre("gain", "offset of session 0", "offset of session 1",
                                          "offset of session 2", "offset of session 3"));
}

TEST(DiscoverTable, SaysNothingAboveTheNoiseWhereThereIsNothing) {
  const auto discovery =
      discoverTable(write("null.csv", csvOf(plant(9, {Hidden::Nothing}, 0.0).data)), withReference());
  ASSERT_TRUE(discovery) << discovery.error().message;
  EXPECT_THAT(verdictOf(*discovery), HasSubstr("Nothing above the noise"));
  EXPECT_THAT(modelToml(*discovery), testing::Not(HasSubstr("[[effect]]")));
}

/// Rows that wander, in the order of the distance: a curve over it that was gone through once would look like that.
TEST(DiscoverTable, DoesNotCallAWanderInTheOrderOfACovariateNothing) {
  std::mt19937 random{3};
  std::normal_distribution<double> noise{0.0, 0.5};
  std::string text = "distance_mm,error_mm\n";
  for (int i = 0; i < 400; ++i) text += fmt::format("{},{}\n", 1000 + i, noise(random));
  auto discovery = discoverTable(write("wander.csv", text), {});
  ASSERT_TRUE(discovery) << discovery.error().message;
  ASSERT_THAT(verdictOf(*discovery), HasSubstr("Nothing above the noise"));
  const std::vector<RowClock> clocks = clocksOf(discovery->open);
  ASSERT_FALSE(clocks.empty());
  RowDependence wander{
      .clock = clocks.front(), .best = {{.share = 0.8, .neighbour = 0.99}, 1.0, 1.0}, .falls_by = 30.0};
  discovery->noise.dependence = wander;
  EXPECT_THAT(verdictOf(*discovery),
              HasSubstr("the rows stand in the order of distance_mm: a curve over it that was gone through once, or a "
                        "wander with time, which these rows do not tell apart"));
  std::ranges::shuffle(wander.clock.order, random);
  discovery->noise.dependence = wander;
  EXPECT_THAT(verdictOf(*discovery), HasSubstr("something that changes with time and that no column tells, or a wander"));
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

/// Without any noise a curve is no better than the line that it is.
TEST(DiscoverTable, CallsAStraightLineWithoutNoiseAStraightLine) {
  std::mt19937 random{5};
  std::uniform_real_distribution<double> uniform;
  std::string text = "reference_mm,measured_mm,temp_c\n";
  for (int i = 0; i < 200; ++i) {
    const double reference = 500.0 + 6500.0 * uniform(random), temperature = 16.0 + 18.0 * uniform(random);
    text += fmt::format("{:.6f},{:.6f},{:.6f}\n", reference, reference + 5.0 + 0.6 * (temperature - 25.0), temperature);
  }
  const auto discovery = discoverTable(write("exact.csv", text), {});
  ASSERT_TRUE(discovery) << discovery.error().message;
  ASSERT_EQ(discovery->finding.effects.size(), 1u);
  EXPECT_EQ(discovery->finding.effects[0].name, "temp_c");
}

TEST(TableMap, SaysUnknownKeysAndDoubleMeanings) {
  EXPECT_THAT(loadTableMap(write("a.toml", "mesured = 'a'\n")).error().message, HasSubstr("mesured"));
  EXPECT_THAT(loadTableMap(write("open.toml", "measured = \"a\n")).error().message,
              HasSubstr("texts in quotes: measured = \"depth_mm\""));
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
