// SPDX-License-Identifier: Apache-2.0
// Tables of measured scan lines and series, judged by the traits that a run's frames are judged by.
#include "calib/compare/table_traits.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "calib/compare/thesis_data.h"
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
  EXPECT_THAT(other->verdict, HasSubstr("Clearest difference: drift, −1.99 mm"))
      << "2 mm, of which e^(−1190/200) is still to come";
  EXPECT_THAT(toHtml(*other), testing::AllOf(HasSubstr("A: one exponential"), HasSubstr("B: one exponential"),
                                             HasSubstr("B − A [mm]")));
}

TEST_F(Table, OfEveryKindSaysWhatItLacks) {
  const fs::path file = write("a.csv", "bird\n1\n");
  for (const TableKind& kind : tableKinds()) {
    const auto refused = loadTable({.file = file, .kind = kind.name, .frequency_hz = {20e6}});
    ASSERT_FALSE(refused) << kind.name;
    EXPECT_THAT(refused.error().message, testing::AllOf(
        HasSubstr(fmt::format("has no column \"{}\"", kind.columns.front())), HasSubstr("--columns says which")));
  }
  const auto refusal = [&](const TableJob& job) { return loadTable(job).error().message; };
  EXPECT_THAT(refusal({.file = file, .kind = "harmonics"}), HasSubstr("--frequency-mhz"));
  EXPECT_THAT(refusal({.file = file, .kind = "song"}), HasSubstr("no kind of table \"song\""));
  EXPECT_THAT(refusal({.file = file, .kind = "drift", .columns = {"bird"}}), HasSubstr("takes 2 columns"));
  EXPECT_THAT(refusal({.file = file, .kind = "drift", .columns = {"bird_mm", "bird"}}),
              HasSubstr("of another quantity"));
}

/// 120 s and 9 mm, written in the units that tables have.
TEST_F(Table, UnderstandsTheUsualSpellingsOfUnits) {
  const fs::path file =
      write("a.csv",
            "time_min,time_h,TIME_MS,t [ms],elapsed (s),t_us,t_hours,value_cm,v [m],VALUE_MM,value_in,h,z\n"
            "2,0.0333333333333333,120000,120000,120,120000000,0.0333333333333333,0.9,0.009,9,"
            "0.354330708661417,0.0333333333333333,9\n");
  const auto read = [&](std::vector<std::string> columns) {
    return loadTable({.file = file, .kind = "drift", .columns = std::move(columns)});
  };
  for (const char* time :
       {"time_min", "time_h", "TIME_MS", "t [ms]", "elapsed (s)", "t_us", "t_hours", "h"}) {
    const auto table = read({time, "VALUE_MM"});
    ASSERT_TRUE(table) << table.error().message;
    EXPECT_NEAR(table->values[0][0], 120.0, 1e-9) << time;
    EXPECT_THAT(table->notes, testing::IsEmpty()) << time;
  }
  for (const char* value : {"value_cm", "v [m]", "VALUE_MM", "value_in", "z=mm"}) {
    const auto table = read({"t_us", value});
    ASSERT_TRUE(table) << table.error().message;
    EXPECT_NEAR(table->values[1][0], 9.0, 1e-9) << value;
    EXPECT_THAT(table->notes, testing::IsEmpty()) << value;
  }
  const auto without = read({"t_us", "z"});
  ASSERT_TRUE(without);
  EXPECT_THAT(without->notes, testing::ElementsAre("column \"z\" says no unit and is taken as mm"));
}

TEST_F(Table, RefusesUnitsThatItDoesNotKnow) {
  const fs::path file = write("a.csv", "time_s,t\n1,2\n");
  for (const char* time :
       {"t_mon", "t [ticks]", "t (camera)", "t_Ms", "t_ms_per_frame", "t=fortnight", "t_mm"}) {
    const auto refused = loadTable({.file = file, .kind = "drift", .columns = {time, "v_mm"}});
    ASSERT_FALSE(refused) << time;
    EXPECT_THAT(refused.error().message, testing::AllOf(HasSubstr("cannot stand for time_s"),
                                                        HasSubstr("known are s, ms, us, ns, min, h, d")))
        << time;
  }
  const auto named = loadTable({.file = file, .kind = "drift", .columns = {"t_raw", "v_mm"}});
  EXPECT_THAT(named.error().message, HasSubstr("has no column \"t_raw\"")) << "raw is no unit";
}

/// Of rows on an exact curve arithmetic leaves waves of 1e-16 mm, and left no interval about them.
TEST_F(Table, TakesWhatArithmeticLeavesForNothing) {
  std::string line = "distance_m,error_mm\n", level = line;
  for (int i = 0; i < 100; ++i) {
    const double distance_m = 0.5 + 0.02 * i;
    line += fmt::format("{},{}\n", distance_m, 5.0 + 2.0 * distance_m), level += fmt::format("{},5\n", distance_m);
  }
  const auto verdictOn = [&](const std::vector<TableJob>& jobs) {
    const auto report = judgeTables(jobs);
    return report ? report->verdict : report.error().message;
  };
  const auto jobOf = [&](const char* name, const std::string& text) {
    return TableJob{.file = write(name, text), .kind = "harmonics", .frequency_hz = {80e6}};
  };
  const TableJob a = jobOf("level.csv", level), b = jobOf("line.csv", line);
  EXPECT_THAT(verdictOn({a}), HasSubstr("offset: 5 mm (5 to 5), the clearest of"));
  EXPECT_THAT(verdictOn({a, b}), testing::AllOf(testing::Not(HasSubstr("wave")), HasSubstr("scale, +2 mm/m (2 to 2)")));
  std::string alike = "time_s,value_mm\n";
  for (int i = 0; i < 120; ++i) alike += fmt::format("{},1500\n", 10 * i);
  EXPECT_THAT(verdictOn({{.file = write("alike.csv", alike), .kind = "drift"}}),
              testing::StartsWith("The one number told is not certain to be other than 0."));
}

TEST_F(Table, SaysWhatIsOddAboutItsRows) {
  const auto notesOn = [&](const std::string& text) {
    const auto table = loadTable({.file = write("a.csv", text), .kind = "drift"});
    EXPECT_TRUE(table) << table.error().message;
    return table ? table->notes : std::vector<std::string>{};
  };
  std::string whole, alike, fine;
  for (int i = 0; i < 48; ++i) {
    whole += fmt::format("{},{}\n", i, 900 + i % 3);
    alike += fmt::format("{},900\n", i);
    fine += fmt::format("{},{}\n", i, 900.0 + 0.1 * std::sin(1.7 * i));
  }
  const std::string header = "time_s,value_mm\n";
  EXPECT_THAT(notesOn("\xEF\xBB\xBF" + header + fine), testing::IsEmpty())
      << "a byte order mark is none of a name";
  EXPECT_THAT(notesOn(header + fine + "48,nan\n49,inf\n"),
              testing::ElementsAre("2 of 50 rows hold a value that is not finite, and are left out"));
  EXPECT_THAT(notesOn(header + fine + "48,900000\n"),
              testing::ElementsAre("value_mm goes up to 900 m, which may be another unit"));
  EXPECT_THAT(notesOn(header + whole),
              testing::ElementsAre(HasSubstr("in steps of 1 mm: a mean of these 48 rows is "
                                             "not known better than to about 0.042 mm")))
      << "1/√(12·48)";
  EXPECT_THAT(notesOn(header + alike),
              testing::ElementsAre(HasSubstr("all 48 readings of value_mm are alike")));
}

/// Which look like a perfect twin. A copy may have its rows in another order, more of them, or a row that is not finite.
TEST_F(Table, SaysWhereOneIsGivenTwiceAndIsNotGreen) {
  const auto rowsOf = [](int from, int to, double more) {
    std::string rows;
    for (int i = from; i < to; ++i)
      rows += fmt::format("{},{}\n", i, 900.0 + (i % 7 == 3 ? more : 0.0) + 0.1 * std::sin(1.7 * i));
    return rows;
  };
  const std::string header = "time_s,value_mm\n";
  const fs::path a = write("a.csv", header + rowsOf(0, 48, 0.0));
  const auto judged = [&](const std::string& rows) {
    auto report = judgeTables({{.file = a, .kind = "drift"}, {.file = write("b.csv", header + rows), .kind = "drift"}});
    EXPECT_TRUE(report) << report.error().message;
    const bool is_green =
        std::ranges::any_of(report->cards, [](const Card& card) { return card.tone == Tone::Good; });
    return std::pair{report->verdict, is_green};
  };
  const auto [same, is_same_green] = judged(rowsOf(0, 48, 0.0) + "48,nan\n");
  EXPECT_THAT(same, testing::StartsWith("A and B have the same 48 rows: one table may be given twice"));
  EXPECT_FALSE(is_same_green);
  EXPECT_THAT(judged(rowsOf(0, 60, 0.0)).first, testing::StartsWith("Each of A's 48 rows is one of B's 60: "));
  EXPECT_THAT(judged(rowsOf(0, 40, 0.0)).first, testing::StartsWith("Each of B's 40 rows is one of A's 48: "));
  const auto [other, is_other_green] = judged(rowsOf(0, 48, 0.001));
  EXPECT_THAT(other, testing::StartsWith("In the one number told B does not differ"));
  EXPECT_TRUE(is_other_green);
}

TEST_F(Table, SaysWhatIsWrongWithSessions) {
  const auto errorOf = [&](const std::string& first, const std::string& others) {
    std::string text = "speed_m_per_s,error_mm,session\n0,1," + first + "\n";
    for (int i = 1; i < 12; ++i) text += fmt::format("{},{},{}\n", 0.1 * i, i % 3, others.empty() ? fmt::to_string(i) : others);
    const auto table = loadTable({.file = write("s.csv", text), .kind = "motion"});
    return table ? std::string{} : table.error().message;
  };
  EXPECT_THAT(errorOf("morning", "2"), HasSubstr("s.csv:2: \"morning\" in column \"session\" is not a number"));
  EXPECT_EQ(errorOf("morning", "morning"), "");
  EXPECT_THAT(errorOf("", "2"), HasSubstr("column \"session\" is nan in row 1"));
  EXPECT_THAT(errorOf("nan", "2"), HasSubstr("column \"session\" is nan in row 1"));
  EXPECT_THAT(errorOf("0", ""), HasSubstr("has 12 values in 12 rows: it takes 3 rows of each"));
  EXPECT_EQ(errorOf("1", "1"), "");
}

/// Two sessions, 4 mm apart: the slope is as if there were one, and the note says what was done.
TEST_F(Table, TellsSessionsApartByTheirColumn) {
  const auto rows = [](bool has_column) {
    std::string text = has_column ? "speed_m_per_s,error_mm,session\n" : "speed_m_per_s,error_mm\n";
    for (int i = 0; i < 60; ++i) {
      const bool is_second = i >= 30;
      text += fmt::format("{},{}", i / 30.0, 0.25 * i + (is_second ? 4.0 : 0.0) + 0.1 * std::sin(1.7 * i));
      text += has_column ? fmt::format(",{}\n", is_second ? 2 : 1) : "\n";
    }
    return text;
  };
  const auto slopeOf = [&](bool has_column) {
    const auto report = judgeTables({{.file = write("a.csv", rows(has_column)), .kind = "motion"}});
    EXPECT_TRUE(report);
    const std::string text = toMarkdown(*report);
    EXPECT_EQ(text.find("rows are of 2 sessions") != std::string::npos, has_column);
    EXPECT_EQ(text.find("there is a step before row 31") != std::string::npos, !has_column);
    return report->verdict;
  };
  EXPECT_THAT(slopeOf(true), testing::StartsWith("motion, per speed: 7.48"));
  EXPECT_THAT(slopeOf(false), HasSubstr("in doubt"));
  const auto drift = loadTable(
      {.file = write("b.csv", "time_s,value_mm,session\n0,1,1\n1,2,1\n2,3,2\n"), .kind = "drift"});
  ASSERT_TRUE(drift) << drift.error().message;
  EXPECT_THAT(drift->notes, testing::Contains("column \"session\", of 2 values, is not heeded"));
}

/// Twelve rows of each of three sessions, of which those of one have no error; and rows of one speed stay together.
TEST_F(Table, CountsSessionsAndPlacesOfTheRowsThatAreFinite) {
  const auto rows = [](int without) {
    std::string text = "speed_m_per_s,error_mm,session\n";
    for (int i = 0; i < 36; ++i)
      text += fmt::format("{},{},{}\n", 0.2 * (i % 6), i / 12 < without ? "nan" : fmt::to_string(std::sin(1.7 * i)), i / 12);
    return text;
  };
  const auto one_less = loadTable({.file = write("a.csv", rows(1)), .kind = "motion"});
  ASSERT_TRUE(one_less) << one_less.error().message;
  EXPECT_THAT(one_less->notes, testing::ElementsAre(HasSubstr("12 of 36 rows"), HasSubstr("rows are of 2 sessions"),
                                                    HasSubstr("speed_m_per_s has 6 values in 24 rows")));
  const auto one_left = loadTable({.file = write("a.csv", rows(2)), .kind = "motion"});
  ASSERT_TRUE(one_left) << one_left.error().message;
  EXPECT_THAT(one_left->notes, testing::Contains("column \"session\", of 1 value, is not heeded"));
  EXPECT_TRUE(one_left->session.empty());
}

/// Three of 48 readings about 900 mm are 0: the drift is that of the others, 2 mm in 48 s.
TEST_F(Table, TakesZerosAsNoRange) {
  std::string rows = "time_s,value_mm\n", errors = "time_s,value_mm\n";
  for (int i = 0; i < 48; ++i) {
    rows += fmt::format("{},{}\n", i, i % 20 == 7 ? 0.0 : 900.0 + i / 24.0 + 0.1 * std::sin(1.7 * i));
    errors += fmt::format("{},{}\n", i, i % 20 == 7 ? 0.0 : i / 24.0 + 0.1 * std::sin(1.7 * i));
  }
  const auto table = loadTable({.file = write("a.csv", rows), .kind = "drift"});
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_THAT(table->notes,
              testing::ElementsAre("column value_mm: no reading: 0 is far from all other values (lines 9, 29, 49)",
                                   "3 of 48 rows hold a value that is not finite, and are left out"));
  const auto report = judgeTables({{.file = write("a.csv", rows), .kind = "drift"}});
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_THAT(report->verdict, testing::StartsWith("drift, slope: 0.04")) << "1/24 mm/s";

  const auto near_zero = loadTable({.file = write("b.csv", errors), .kind = "drift"});
  ASSERT_TRUE(near_zero) << near_zero.error().message;
  EXPECT_THAT(near_zero->notes, testing::IsEmpty()) << "0 is a reading among others";

  std::string line = "line,range_m\n";
  for (int i = 0; i < 60; ++i)
    line += fmt::format("1,{}\n", i % 10 == 3 ? 0.0 : 1.0 + (i > 30 ? 2.0 : 0.0) + 1e-3 * i);
  const auto ranges = loadTable({.file = write("c.csv", line), .kind = "flying_pixels"});
  ASSERT_TRUE(ranges) << ranges.error().message;
  EXPECT_THAT(ranges->notes,
              testing::ElementsAre(HasSubstr("6 of 60 rows have a range_m of 0, which is no range")));
}

TEST_F(Table, RefusesFieldsThatItWouldMistake) {
  const auto refusalOf = [&](const std::string& text) {
    return loadTable({.file = write("a.csv", text), .kind = "drift"}).error().message;
  };
  EXPECT_THAT(refusalOf("time_s,value_mm\n0,1\n1,2,5\n"), HasSubstr("a.csv:3: has 3 fields, but the header has 2"));
  EXPECT_THAT(refusalOf("time_s,value_mm\n0,1\n1,x7\n2,2\n3,3\n4,4\n5,5\n"),
              HasSubstr("a.csv:3: \"x7\" in column \"value_mm\" is not a number"));
  EXPECT_THAT(refusalOf("time_s,value_mm,value_mm\n0,1,2\n"), HasSubstr("has two columns \"value_mm\""));
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

/// Errors over distance of −1 mm + 3 mm/m and a wave, with noise of 0.3 mm.
std::string errorsOf(double to_m, double cosine_mm, double sine_mm, unsigned seed) {
  std::mt19937_64 random{seed};
  std::normal_distribution<double> error{0.0, 0.3};
  std::string text = "distance_m,error_mm\n";
  const double per_m = 4.0 * 4.0 * std::numbers::pi * 30e6 / 299'792'458.0;
  for (int i = 0; i < 200; ++i) {
    const double d = 0.5 + (to_m - 0.5) * i / 199.0;
    text += fmt::format(
        "{},{}\n", d,
        -1.0 + 3.0 * d + cosine_mm * std::cos(per_m * d) + sine_mm * std::sin(per_m * d) + error(random));
  }
  return text;
}

TableJob harmonicsOf(fs::path file) {
  return {.file = std::move(file), .kind = "harmonics", .frequency_hz = {30e6}};
}

/// One line, seen to 5.5 m and to 3 m: at the middles of these it is 3.75 mm apart. Of 8 numbers none differs
/// in 95 % of seeds.
TEST_F(Table, OfTheSameLineOverOtherDistancesHaveTheSameOffset) {
  RecordProperty("seed", 1);
  const auto report = judgeTables({harmonicsOf(write("far.csv", errorsOf(5.5, 0.0, 0.0, 1))),
                                   harmonicsOf(write("near.csv", errorsOf(3.0, 0.0, 0.0, 2)))});
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_THAT(report->verdict, HasSubstr("In none of "));
  EXPECT_THAT(toMarkdown(*report),
              testing::ContainsRegex("harmonics: offset at 1.75 m \\[mm\\] . same, within "));
}

/// 6 mm in both, opposite: 12 mm apart. Four standard errors of the difference of two amplitudes of 200 rows
/// are 0.17 mm.
TEST_F(Table, OfWavesAgainstEachOtherDifferByTheirPhasors) {
  RecordProperty("seed", 1);
  const auto report = judgeTables({harmonicsOf(write("a.csv", errorsOf(5.5, 0.0, 6.0, 1))),
                                   harmonicsOf(write("b.csv", errorsOf(5.5, 0.0, -6.0, 2)))});
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_THAT(report->verdict, HasSubstr("wave, 30 MHz, 4 per period, 12"));
  const Json* rows = report->data.find("verdicts");
  EXPECT_EQ(rows->at(0).find("name")->words(), "30 MHz, 4 per period");
  EXPECT_NEAR(rows->at(0).find("difference")->number(), 12.0, 0.17);
}

/// σ = √(1 + 3²·4000/I) mm, and the same rows only up to a signal of 1000: shot noise at the largest is twice
/// as much.
TEST_F(Table, OfTheSameLawUpToOtherSignalsAreTheSame) {
  const auto rowsUpTo = [](double most) {
    std::string text = "signal,sigma_mm\n";
    for (int i = 0; i < 80; ++i) {
      const double signal = 40.0 * std::pow(100.0, i / 79.0);
      if (signal <= most)
        text += fmt::format("{},{}\n", signal,
                            (1.0 + 0.01 * (i % 3 - 1)) * std::sqrt(1.0 + 9.0 * 4000.0 / signal));
    }
    return text;
  };
  const auto report = judgeTables({{.file = write("all.csv", rowsUpTo(4000.0)), .kind = "noise_law"},
                                   {.file = write("few.csv", rowsUpTo(1000.0)), .kind = "noise_law"}});
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_THAT(report->verdict, HasSubstr("In none of "));
  EXPECT_THAT(toMarkdown(*report),
              testing::ContainsRegex("noise_law: shot .* same, within .*, both at a signal of 9"));
}

TEST_F(Table, OfDriftsOverOtherTimesAreNotHeldAgainstEachOther) {
  const auto driftUpTo = [](int rows) {
    std::string text = "time_s,value_mm\n";
    for (int i = 0; i < rows; ++i)
      text += fmt::format("{},{}\n", 10 * i, 0.05 * i + (i % 2 == 0 ? 0.01 : -0.01));
    return text;
  };
  const auto report = judgeTables({{.file = write("long.csv", driftUpTo(181)), .kind = "drift"},
                                   {.file = write("short.csv", driftUpTo(61)), .kind = "drift"}});
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_THAT(toMarkdown(*report), HasSubstr("not told: A's rows are over 1800 s and B's over 600 s"));
  EXPECT_THAT(report->verdict, HasSubstr("In the one number told B does not differ")) << "the slope is the same";
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
