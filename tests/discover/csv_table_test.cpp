// SPDX-License-Identifier: Apache-2.0
// Text tables: what can be read, and what is said of what cannot.
#include <gmock/gmock.h>

#include <map>
#include <random>
#include <set>

#include "calib/discover/discover_table.h"
#include "calib/discover/headers.h"
#include "calib/discover/table_field.h"

namespace toftwin::discover {
namespace {

using testing::ElementsAre;
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
}

TEST(ParseCsv, SaysWhichLineIsWrongAndHow) {
  EXPECT_THAT(errorOf("a,b\n1,2\n3\n"), HasSubstr("t.csv:3: has 1 fields, but the header has 2"));
  EXPECT_THAT(errorOf("a,b\n1,\"2\n"), HasSubstr("t.csv:2: a quote is opened"));
  EXPECT_THAT(errorOf("a,a\n1,2\n"), HasSubstr("two columns are called \"a\""));
  EXPECT_THAT(errorOf("a,\n1,2\n"), HasSubstr("column 2 has no header"));
  EXPECT_THAT(errorOf(""), HasSubstr("is empty"));
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

TEST(Headers, MapErrorsNameColumnAndKey) {
  TableMap map;
  map.measured = "depht";
  EXPECT_THAT(rolesOf({"depth", "t"}, map, "t.csv").error().message,
              HasSubstr("no column \"depht\" for `measured`"));
  map.measured = "depth", map.reference = "depth";
  EXPECT_THAT(rolesOf({"depth", "t"}, map, "t.csv").error().message, HasSubstr("has two roles"));
  map.reference = "", map.ignore = {"u"};
  EXPECT_THAT(rolesOf({"depth", "t"}, map, "t.csv").error().message, HasSubstr("no column \"u\" to ignore"));
}

Result<TableData> dataOf(const std::string& text, const TableMap& map = {}) {
  const auto table = parseCsv(text, "t.csv");
  return table ? readTable(*table, map, "t.csv") : Result<TableData>{table.error()};
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
  EXPECT_THAT(dataOf(linear(19)).error().message, HasSubstr("has 19 usable rows; at least 20"));
  std::string bare = "measured_mm,reference_mm\n";
  for (int i = 0; i < 30; ++i) bare += "1001,1000\n";
  EXPECT_THAT(dataOf(bare).error().message, HasSubstr("no column that changes"));
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
  for (const char* no : {"", "10", "10:", "24:00:00", "10:60", "10:00:00x", "1970-13-01T00:00:00", "1970-01-01",
                         "1970-01-01T00:00:00+0200"})
    EXPECT_FALSE(secondsIn(no)) << no;
}

}  // namespace
}  // namespace toftwin::discover
