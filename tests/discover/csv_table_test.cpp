// SPDX-License-Identifier: Apache-2.0
// Text tables: what can be read, and what is said of what cannot.
#include <gmock/gmock.h>

#include <cmath>
#include <map>
#include <random>
#include <set>

#include <fmt/format.h>

#include "calib/discover/discover_table.h"
#include "calib/discover/headers.h"
#include "calib/discover/table_field.h"

namespace toftwin::discover {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;

std::string errorOf(const std::string& text) {
  const auto table = parseCsv(text, "t.csv");
  return table ? "no error" : table.error().message;
}

TEST(ParseCsv, ReadsQuotesSemicolonsTabsCommentsAndWindowsLines) {
  const auto table =
      parseCsv("\xEF\xBB\xBF# made by hand\r\na;\"b;c\"\r\n1; \"say \"\"x\"\"\"\r\n\r\n2;y\r\n", "t.csv");
  ASSERT_TRUE(table);
  EXPECT_THAT(table->header, ElementsAre("a", "b;c"));
  EXPECT_THAT(table->columns[1], ElementsAre("say \"x\"", "y"));
  EXPECT_THAT(table->line, ElementsAre(3u, 5u));
  EXPECT_EQ(parseCsv("a\tb\n1\t2\n", "t.csv")->header.size(), 2u);
  EXPECT_THAT(parseCsv("a,b\r1,2\r\r3,4\r", "t.csv")->line, ElementsAre(2u, 4u)) << "old Macs' lines";
}

TEST(ParseCsv, TakesTheSeparatorThatExcelSays) {
  const auto table = parseCsv("sep=;\na,b;c\n1,5;2\n", "t.csv");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_THAT(table->header, ElementsAre("a,b", "c"));
  EXPECT_THAT(table->line, ElementsAre(3u));
}

/// 0xB0 is the degree sign and 0x80 the euro sign there; alone they are no UTF-8.
TEST(ParseCsv, ReadsWindows1252AsUtf8AndKeepsUtf8) {
  const auto old = parseCsv("T [\xB0\x43],\x80\n1,2\n", "t.csv"),
             now = parseCsv("T [\xC2\xB0\x43],\xE2\x82\xAC\n1,2\n", "t.csv");
  ASSERT_TRUE(old && now);
  EXPECT_EQ(old->header, now->header);
  EXPECT_TRUE(old->is_from_windows);
  EXPECT_FALSE(now->is_from_windows);
}

TEST(ParseCsv, SaysWhichLineIsWrongAndHow) {
  EXPECT_THAT(errorOf("a,b\n1,2\n3\n"), HasSubstr("t.csv:3: has 1 field, but the header has 2"));
  EXPECT_THAT(errorOf("a,b\n1,1500,25\n"), HasSubstr("t.csv:2: has 3 fields, but the header has 2; commas in its"));
  EXPECT_THAT(errorOf("a;b\n1;2;3\n"), EndsWith("t.csv:2: has 3 fields, but the header has 2"));
  EXPECT_THAT(errorOf("a,b\n1,\"2\n"), HasSubstr("t.csv:2: a quote is opened"));
  EXPECT_THAT(errorOf("a,a\n1,2\n"), HasSubstr("two columns are called \"a\": rename one"));
  EXPECT_THAT(errorOf("a,\n1,2\n"), HasSubstr("column 2 has no header"));
  EXPECT_THAT(errorOf(""), HasSubstr("is empty"));
  EXPECT_THAT(errorOf("a b\n1 2\n"), HasSubstr("t.csv:1: no comma, semicolon or tab parts \"a b\" into columns"));
  EXPECT_THAT(errorOf("a,b\n"), HasSubstr("has a header but no rows"));
  EXPECT_THAT(errorOf(std::string("a,b\n1,\0\n", 8)), HasSubstr("zero bytes"));
}

std::string rolesIn(const std::vector<std::string>& header) {
  const auto roles = rolesOf(header, {}, "t.csv");
  return roles ? roles->inWords() : roles.error().message;
}

TEST(Headers, SayWhatTheColumnsAre) {
  EXPECT_EQ(rolesIn({"time_s", "depth_mm"}), "error = depth_mm (without a reference); covariates: time_s");
  EXPECT_EQ(rolesIn({"reference_mm", "reference_minus_measured_mm"}),
            "error = −reference_minus_measured_mm; covariates: reference_mm");
  EXPECT_EQ(
      rolesIn({"measured_mm", "reference_mm", "sigma_mm", "run", "locked", "temperature_c"}),
      "error = measured_mm − reference_mm; sigma = sigma_mm; session = run; locked = locked; covariates: "
      "reference_mm, temperature_c");
  EXPECT_EQ(rolesIn({"range_error_mm", "distance_m", "exposure_time_us"}),
            "error = range_error_mm; covariates: distance_m, exposure_time_us");
  EXPECT_THAT(rolesIn({"a", "b"}), HasSubstr("which column was measured?"));
}

TEST(Headers, ExposureTimeIsNoTime) {
  EXPECT_EQ(natureOf("exposure_time_us", MapNature::Guessed), Nature::Plain);
  EXPECT_EQ(natureOf("time_s", MapNature::Guessed), Nature::Time);
  EXPECT_EQ(natureOf("frame", MapNature::Guessed), Nature::Index);
  EXPECT_EQ(natureOf("distance_m", MapNature::Plain), Nature::Plain);
}

TEST(Headers, UnderstandGerman) {
  EXPECT_EQ(rolesIn({"Messwert [mm]", "Referenz [mm]", "Sitzung", "Aufnahme", "Temperatur [C]", "Zeit [s]"}),
            "error = Messwert [mm] − Referenz [mm]; session = Sitzung; capture = Aufnahme; covariates: "
            "Referenz [mm], "
            "Temperatur [C], Zeit [s]");
  EXPECT_EQ(natureOf("Zeit [s]", MapNature::Guessed), Nature::Time);
  EXPECT_EQ(natureOf("Abstand [mm]", MapNature::Guessed), Nature::Distance);
}

TEST(Headers, TheLikeliestWordNamesTheSession) {
  EXPECT_EQ(rolesIn({"error_mm", "day", "session", "t_s"}),
            "error = error_mm; session = session; covariates: day, t_s");
  EXPECT_EQ(rolesIn({"error_mm", "run", "day"}), "error = error_mm; session = run; covariates: day");
  EXPECT_EQ(rolesIn({"error_mm", "session_id", "session_note"}),
            "error = error_mm; session = session_id; covariates: session_note");
  EXPECT_EQ(rolesIn({"error_mm", "run_time_s"}), "error = error_mm; covariates: run_time_s");
  EXPECT_EQ(rolesIn({"error_mm", "pose_x", "pose_y"}), "error = error_mm; covariates: pose_x, pose_y");
  EXPECT_THAT(rolesIn({"error_mm", "session_hall", "session_field"}),
              HasSubstr("which column names the session: session_hall, session_field?"));
}

TEST(Headers, MapErrorsNameColumnAndKey) {
  TableMap map;
  map.measured = "depht";
  EXPECT_THAT(rolesOf({"depth", "t"}, map, "t.csv").error().message,
              HasSubstr("no column \"depht\" for `measured`"));
  map.measured = "depth", map.reference = "depth";
  EXPECT_THAT(rolesOf({"depth", "t"}, map, "t.csv").error().message, HasSubstr("\"depth\" has two roles, `measured` and `reference`"));
  map.reference = "", map.ignore = {"u"};
  EXPECT_THAT(rolesOf({"depth", "t"}, map, "t.csv").error().message, HasSubstr("no column \"u\" to ignore"));
}

Result<TableData> dataOf(const std::string& text, const TableMap& map = {}) {
  const auto table = parseCsv(text, "t.csv");
  return table ? readTable(*table, map, "t.csv") : Result<TableData>{table.error()};
}

std::vector<std::string> covariatesOf(const TableData& data) {
  std::vector<std::string> names;
  for (const TableCovariate& covariate : data.covariates) names.push_back(covariate.name);
  return names;
}

std::string linear(int rows, const std::string& odd_line = "") {
  std::string text = "measured_mm,reference_mm,time_s,lamp\n";
  for (int i = 0; i < rows; ++i) text += std::to_string(1000 + i) + ",1000," + std::to_string(i) + ",on\n";
  return text + odd_line;
}

TEST(ReadTable, LeavesOutRowsWithoutAValueAndSaysHowMany) {
  const auto data = dataOf(linear(30, "nan,1000,5,on\n7,,5,on\n7,1000,inf,on\n"));
  ASSERT_TRUE(data);
  EXPECT_EQ(data->rows(), 30u);
  EXPECT_THAT(data->doubts, testing::Contains(HasSubstr("3 of 33 rows")));
  EXPECT_THAT(data->doubts, testing::Contains(HasSubstr("\"lamp\" never changes")));
  EXPECT_THAT(data->doubts, testing::Contains(HasSubstr("one session only")));
}

TEST(ReadTable, GuessesNoThousandsAndGoesOnOverMidnight) {
  const auto table = [](const std::string& first) {
    std::string text = "measured_mm;reference_mm;time\n";
    for (int i = 0; i < 30; ++i) {
      const int minute = 23 * 60 + 50 + i;
      text += (i == 0 ? first : "1,02" + std::to_string(i % 10)) + ";1;" +
              std::to_string(minute / 60 % 24 / 10) + std::to_string(minute / 60 % 24 % 10) + ":" +
              std::to_string(minute % 60 / 10) + std::to_string(minute % 10) + "\n";
    }
    return text;
  };
  EXPECT_THAT(dataOf(table("950")).error().message,
              HasSubstr("t.csv:3: \"1,021\" in column \"measured_mm\" may be a thousand or a fraction"));
  const auto data = dataOf(table("0,950"));
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_NEAR(data->error[1], 0.021, 1e-12);
  ASSERT_EQ(data->covariates.size(), 1u);
  EXPECT_EQ(data->covariates[0].values.front(), 0.0);
  EXPECT_EQ(data->covariates[0].values.back(), 29 * 60.0);
}

TEST(ReadTable, RefusesTextAmongNumbersTooFewRowsAndNothingToGoWith) {
  EXPECT_THAT(dataOf(linear(30, "x7,1000,5,on\n")).error().message,
              HasSubstr("t.csv:32: \"x7\" in column \"measured_mm\" is not a number"));
  EXPECT_THAT(dataOf(linear(30, "\"2.596,3\",1000,5,on\n")).error().message,
              HasSubstr("points that part thousands"));
  EXPECT_THAT(dataOf(linear(30, "x7,1000,5,on\n")).error().message, HasSubstr("leave the field empty"));
  std::string with_units = linear(30);
  with_units.insert(with_units.find('\n') + 1, "mm,mm,s,\n");
  EXPECT_THAT(dataOf(with_units).error().message,
              HasSubstr("t.csv:2: \"mm\" in column \"reference_mm\" is not a number: if this line says units"));
  EXPECT_THAT(dataOf(linear(19)).error().message, EndsWith("has 19 usable rows; at least 20 are needed"));
  EXPECT_THAT(dataOf(linear(1)).error().message, HasSubstr("has 1 usable row;"));
  std::string bare = "measured_mm,reference_mm\n";
  for (int i = 0; i < 30; ++i) bare += "1001,1000\n";
  EXPECT_THAT(dataOf(bare).error().message, HasSubstr("no column that changes"));
}

TEST(ReadTable, NamesTheColumnThatIsEmptyWhereNoRowsAreLeft) {
  std::string text = "measured_mm,reference_mm,t_s\n";
  for (int i = 0; i < 30; ++i) text += fmt::format("nan,{},{}\n", 1000 + i, i % 3 == 0 ? "" : "5");
  EXPECT_THAT(dataOf(text).error().message,
              EndsWith("has 0 usable rows; at least 20 are needed: column \"measured_mm\" is empty in 30 of 30"));
}

TEST(Lock, ReadsYesAndNoAndRefusesWhatIsNeither) {
  const auto table = [](const std::string& yes, const std::string& no) {
    std::string text = "error_mm,t_s,locked\n";
    for (int i = 0; i < 30; ++i) text += fmt::format("{},{},{}\n", i % 7, i, i % 3 == 0 ? yes : no);
    return text;
  };
  for (const auto& [yes, no] : {std::pair{"1", "0"}, {"yes", "no"}, {"TRUE", "FALSE"}, {"ja", ""}, {"1.0", "0.0"}}) {
    const auto data = dataOf(table(yes, no));
    ASSERT_TRUE(data) << data.error().message;
    EXPECT_EQ(std::ranges::count(data->locked, true), 10) << yes;
  }
  EXPECT_THAT(dataOf(table("22.7", "0")).error().message,
              HasSubstr("t.csv:2: \"22.7\" in column \"locked\" is neither 1 nor 0, yes nor no"));
}

TEST(Lock, TakesWholeSessionsWhereThereAreFiveAndKeepsTheColumnWhereThereIsOne) {
  std::string text = "error_mm,time_s,session\n";
  for (int i = 0; i < 100; ++i)
    text += std::to_string(i % 7) + "," + std::to_string(i) + "," + std::to_string(i / 10) + "\n";
  auto data = *dataOf(text);
  lock(data, {});
  std::map<int, std::set<bool>> by_session;
  for (std::size_t i = 0; i < data.rows(); ++i) by_session[data.session[i]].insert(data.locked[i]);
  std::size_t locked = 0;
  for (const auto& [session, flags] : by_session) {
    EXPECT_EQ(flags.size(), 1u) << "session " << session;
    locked += *flags.begin();
  }
  EXPECT_EQ(locked, 2u) << "a fifth of ten";
}

/// Rows of 60 captures of 10: a fifth of the captures, each whole, however rows are counted off.
TEST(Lock, DrawsCapturesAndNotBlocksOfRows) {
  std::string text = "error_mm,time_s,capture\n";
  for (int i = 0; i < 600; ++i)
    text += std::to_string(i % 7) + "," + std::to_string(i) + "," + std::to_string(i / 10) + "\n";
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    auto data = *dataOf(text);
    TableMap map;
    map.seed = seed;
    lock(data, map);
    std::map<int, std::set<bool>> by_capture;
    for (std::size_t i = 0; i < data.rows(); ++i) by_capture[data.capture[i]].insert(data.locked[i]);
    for (const auto& [capture, flags] : by_capture) EXPECT_EQ(flags.size(), 1u) << "capture " << capture;
    EXPECT_EQ(std::ranges::count(data.locked, true), 120) << "seed " << seed;
  }
}

/// Beside sessions, what names ten runs in each names captures; what names one in each goes with the session.
TEST(ReadTable, TakesAFinerGroupForCaptures) {
  std::string text = "error_mm,time_s,session,run,day\n";
  for (int i = 0; i < 200; ++i)
    text += std::to_string(i % 7) + "," + std::to_string(i) + "," + std::to_string(i / 50) + "," +
            std::to_string(i % 50 / 5) + "," + std::to_string(i / 50 * 3) + "\n";
  const auto data = dataOf(text);
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ(data->session_names.size(), 4u);
  EXPECT_EQ(data->capture[6], 1);
  EXPECT_THAT(covariatesOf(*data), ElementsAre("time_s", "day"));
}

TEST(ReadTable, BringsTheReferenceToTheUnitOfWhatWasMeasuredAndSaysSo) {
  std::string text = "measured_mm,reference_m,t_s\n";
  for (int i = 0; i < 30; ++i)
    text += std::to_string(1003 + i + i % 2) + "," + std::to_string(1.0 + 0.001 * i) + "," + std::to_string(i) + "\n";
  const auto data = dataOf(text);
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_NEAR(data->error[10], 3.0, 1e-9);
  EXPECT_THAT(data->notes,
              testing::Contains(HasSubstr("the reference is in m, what was measured in mm: converted")));
}

/// 2.5 m is c/(2f) of 60 MHz, known to the noise of two medians, 2 mm each. Ranges of 1 to 3 m with noise of
/// 2 mm; those beyond are folded back.
std::string folded(double fold_mm, int invalid = 0) {
  std::string text = "measured_mm,reference_mm,t_s\n";
  for (int i = 0; i < 200; ++i) {
    const double reference = 1000.0 + 10.0 * i, error = 2.0 * std::sin(1.7 * i);
    const double measured = reference + error - (fold_mm > 0.0 && reference >= fold_mm ? fold_mm : 0.0);
    text += fmt::format("{},{},{}\n", i % 20 < invalid ? 0.0 : measured, reference, i);
  }
  return text;
}

TEST(RowChecks, SetWrappedRowsAsideWithAndWithoutTheFrequency) {
  const auto guessed = dataOf(folded(2500.0));
  ASSERT_TRUE(guessed) << guessed.error().message;
  EXPECT_EQ(guessed->rows(), 150u) << "50 of 200 lie beyond 2.5 m";
  EXPECT_THAT(guessed->doubts,
              testing::Contains(testing::ContainsRegex("50 rows are off by (249[6-9]|250[0-4])")));
  TableMap map;
  map.modulation = 60_MHz;
  EXPECT_EQ(dataOf(folded(299'792.458 / 120.0), map)->rows(), 150u);
  EXPECT_EQ(dataOf(folded(0.0))->rows(), 200u) << "none is folded";
}

/// 299792458/(2 · 60e6) m
TEST(ReadTable, TakesThePeriodInTheUnitOfAHeaderAndInNoneWithoutOne) {
  TableMap map;
  map.modulation = 60_MHz;
  const auto table = [](const std::string& measured, const std::string& reference, double metre) {
    std::string text = measured + "," + reference + ",t_s\n";
    for (int i = 0; i < 30; ++i)
      text += fmt::format("{},{},{}\n", 1e3 * (1.0 + 0.01 * i + 0.001 * (i % 2)), metre * (1.0 + 0.01 * i), i % 7);
    return text;
  };
  EXPECT_NEAR(dataOf(table("measured_mm", "reference_m", 1.0), map)->period, 2.49827, 1e-5);
  EXPECT_NEAR(dataOf(table("measured_mm", "reference", 1e3), map)->period, 2498.27, 1e-2)
      << "subtracted as it is";
  const auto unknown = dataOf(table("measured", "reference", 1e3), map);
  EXPECT_EQ(unknown->period, 0.0);
  EXPECT_THAT(unknown->doubts, testing::Contains(HasSubstr("waves of c/(2f) are not looked for")));
  EXPECT_EQ(dataOf(table("error_mm", "reference", 1e3), map)->period, 0.0)
      << "its reference may be in metres";
}

TEST(ReadTable, SessionsWhoseRowsWereAllSetAsideCountNoMore) {
  std::string text = "measured_mm,reference_mm,t_s,session\n";
  for (int i = 0; i < 200; ++i) {
    const bool is_blind = i / 50 == 1;
    text += fmt::format("{},{},{},{}\n", is_blind ? 0.0 : 1000.0 + 10.0 * i + 2.0 * std::sin(1.7 * i),
                        1000.0 + 10.0 * i, i % 7, "abcd"[i / 50]);
  }
  const auto data = dataOf(text);
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_THAT(data->session_names, ElementsAre("a", "c", "d"));
  EXPECT_EQ(*std::ranges::max_element(data->session), 2);
}

/// Rows that are as far off, but not beyond their own length: an effect of something else, which is to be
/// found.
TEST(RowChecks, AJumpThatIsNoFoldStays) {
  std::string text = "measured_mm,reference_mm,t_s\n";
  for (int i = 0; i < 200; ++i)
    text +=
        fmt::format("{},{},{}\n", 1000.0 + 10.0 * i + 2.0 * std::sin(1.7 * i) - (i % 4 == 0 ? 800.0 : 0.0),
                    1000.0 + 10.0 * i, i);
  EXPECT_EQ(dataOf(text)->rows(), 200u);
}

TEST(RowChecks, SetAValueThatStandsForInvalidAside) {
  const auto data = dataOf(folded(0.0, 1));
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ(data->rows(), 190u);
  EXPECT_THAT(data->doubts, testing::Contains(HasSubstr("10 rows hold 0 mm whatever their reference")));
}

TEST(RowChecks, LeaveOutWhatIsTheMeasuredValueOrTheErrorAgain) {
  std::string text = "measured_mm,reference_mm,filtered_m,offset_mm,temperature_c\n";
  for (int i = 0; i < 100; ++i) {
    const double temperature = 20.0 + 5.0 * std::sin(0.9 * i), error = 3.0 * (temperature - 20.0);
    const double measured = 1000.0 + 10.0 * i + error;
    text += fmt::format("{},{},{},{},{}\n", measured, 1000 + 10 * i,
                        0.001 * (measured + 0.3 * std::sin(2.3 * i)), error, temperature);
  }
  const auto data = dataOf(text);
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_THAT(covariatesOf(*data), ElementsAre("reference_mm", "temperature_c"));
  EXPECT_THAT(data->notes.front(), HasSubstr("left out: filtered_m, offset_mm"));
}

/// In whatever unit, with an offset or rounded; what errors go with stays, though it tells them without noise.
TEST(RowChecks, LeaveOutWhatIsTheMeasuredValueInAnotherUnitAndNothingElse) {
  std::string text = "measured_mm,reference_mm,phase_rad,raw_counts,delay_ns,z_raw_mm,temperature_c,amplitude\n";
  for (int i = 0; i < 100; ++i) {
    const double temperature = 20.0 + 5.0 * std::sin(0.9 * i), reference = 1000.0 + 10.0 * (i * 37 % 100);
    const double measured = reference + temperature - 20.0;
    text += fmt::format("{},{},{:.5f},{:.0f},{:.4f},{:.2f},{},{}\n", measured, reference, measured * 0.000838,
                        measured * 8.74, measured / 149.8962, 1.013 * measured - 20.0, temperature,
                        1e9 / (reference * reference));
  }
  const auto data = dataOf(text);
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_THAT(covariatesOf(*data), ElementsAre("reference_mm", "temperature_c", "amplitude"));
  EXPECT_THAT(data->doubts, testing::Contains(HasSubstr("\"phase_rad\" is the measured value again")));
}

TEST(ReadTable, SaysThatAnErrorIsTheSameInEveryRow) {
  std::string text = "measured_mm,reference_mm,row\n";
  for (int i = 0; i < 30; ++i) text += fmt::format("{},{},{}\n", 1005.1 + i, 1000.1 + i, i);
  EXPECT_THAT(dataOf(text).error().message, HasSubstr("t.csv: the error is 5 mm in every row: an offset"));
}

TEST(ReadTable, ColumnsOfPixelsAreCounted) {
  std::string text = "error_mm,u,pixel_column,x_m,y\n";
  for (int i = 0; i < 40; ++i) text += fmt::format("{},{},{},{},{}\n", i % 7, i % 13, i % 17, i, 0.5 * i);
  const auto data = dataOf(text);
  ASSERT_TRUE(data) << data.error().message;
  const auto nature = [&](std::size_t i) { return data->covariates[i].nature; };
  EXPECT_EQ(nature(0), Nature::Index);
  EXPECT_EQ(nature(1), Nature::Index);
  EXPECT_EQ(nature(2), Nature::Plain) << "x in metres";
  EXPECT_EQ(nature(3), Nature::Plain) << "halves";
}

/// Whatever stands in the file: an answer or an error, never a crash, and no number from nowhere.
TEST(ReadTable, SurvivesAnyBytes) {
  std::mt19937_64 bits{20'261'121};
  const std::string alphabet = "0123456789.,;\t\"\n\r-+eEnaif #\xc3\xa9\x01session,error,time\n";
  const std::string seed_text = linear(40);
  int answers = 0;
  for (int round = 0; round < 3000; ++round) {
    std::string text = round % 2 == 0 ? seed_text : std::string{};
    const auto edits = 1 + bits() % 40;
    for (std::uint64_t e = 0; e < edits; ++e) {
      const char c = bits() % 8 == 0 ? static_cast<char>(bits()) : alphabet[bits() % alphabet.size()];
      const auto at = text.empty() ? 0 : bits() % text.size();
      if (bits() % 3 == 0 && !text.empty())
        text.erase(at, bits() % 5);
      else
        text.insert(std::min<std::size_t>(at, text.size()), 1, c);
    }
    const auto data = dataOf(text);
    answers += static_cast<bool>(data);
    EXPECT_TRUE(data || !data.error().message.empty());
  }
  EXPECT_GT(answers, 20)
      << "some of the damaged tables must still be tables, or nothing behind the parser is tested";
}

TEST(TableField, IsANumberATextOrSaysThatThereIsNone) {
  EXPECT_EQ(numberIn("+1.5", false), 1.5);
  for (const char* none : {"", "NaN", "NA", "n/a", "NULL", "-", "?", "inf", "1e300"})
    EXPECT_TRUE(numberIn(none, false) && std::isnan(*numberIn(none, false))) << none;
  EXPECT_FALSE(numberIn("warm", false));
  EXPECT_FALSE(numberIn("1,5", false)) << "a comma may part thousands";
  EXPECT_EQ(numberIn("1,5", true), 1.5);
  EXPECT_FALSE(numberIn("1.234,5", true));
  EXPECT_FALSE(numberIn("1,234,567", true));
}

TEST(TableField, TimesAreSeconds) {
  EXPECT_EQ(secondsIn("10:15:30.25"), 36'930.25);
  EXPECT_EQ(secondsIn("10:15"), 36'900.0);
  EXPECT_EQ(secondsIn("1970-01-02T00:00:01"), 86'401.0);
  EXPECT_EQ(secondsIn("1970-01-02 00:00:01Z"), 86'401.0);
  EXPECT_EQ(secondsIn("1970-01-01T02:00:00+02:00"), 0.0);
  EXPECT_EQ(secondsIn("1970-01-03"), 2 * 86'400.0);
  EXPECT_EQ(secondsIn("03.01.1970"), 2 * 86'400.0);
  EXPECT_EQ(secondsIn("03.01.1970 00:01"), 2 * 86'400.0 + 60.0);
  for (const char* no : {"", "10", "10:", "24:00:00", "10:60", "10:00:00x", "1970-13-01T00:00:00",
                         "1970-02-30", "1970-01-01x", "32.01.1970", "01.01.70", "1970-01-01T00:00:00+0200"})
    EXPECT_FALSE(secondsIn(no)) << no;
}

}  // namespace
}  // namespace toftwin::discover
