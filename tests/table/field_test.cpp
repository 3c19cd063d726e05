// SPDX-License-Identifier: Apache-2.0
// Single fields and columns: numbers, times, what says nothing.
#include <gmock/gmock.h>

#include <cmath>

#include <fmt/format.h>

#include "calib/table/number.h"
#include "calib/table/readings.h"
#include "calib/table/times.h"

namespace toftwin::table {
namespace {

using testing::HasSubstr;

TEST(NumberField, IsANumberATextOrSaysThatThereIsNone) {
  EXPECT_EQ(numberIn("+1.5", '.'), 1.5);
  EXPECT_EQ(numberIn("\xE2\x88\x92"
                     "1.5",
                     '.'),
            -1.5)
      << "a minus sign of typesetters";
  EXPECT_EQ(numberIn("1.5D+03", '.'), 1500.0);
  EXPECT_EQ(numberIn("1,5e-3", ','), 0.0015);
  for (const char* none : {"", "NaN", "NA", "n/a", "NULL", "-", "?", "inf", "1e300", "#DIV/0!", "#N/A", "#NV",
                           "#WERT!", "OL", "---", "1.#QNAN", "n. a."})
    EXPECT_TRUE(numberIn(none, '.') && std::isnan(*numberIn(none, '.'))) << none;
  for (const char* text : {"warm", "1.5.2", "1,5", "0,816", "12,34,567", "1.2e", "5 mm"})
    EXPECT_FALSE(numberIn(text, '.')) << text;
  EXPECT_EQ(numberIn("1,5", ','), 1.5);
  EXPECT_EQ(numberIn("1.234,5", ','), 1234.5);
  EXPECT_EQ(numberIn("1,234,567.5", '.'), 1234567.5);
  EXPECT_EQ(numberIn("1'234.5", '.'), 1234.5);
  EXPECT_FALSE(numberIn("1.5", ',')) << "no group of three";
}

Column timeIn(const std::vector<std::string>& fields) {
  std::string text = "time;depth_mm\n";
  for (std::size_t i = 0; i < fields.size(); ++i)
    text += fmt::format("{};{}\n", fields[i], 1500.5 + static_cast<double>(i));
  const auto read = parseReadings(text, {}, "t.csv");
  EXPECT_TRUE(read) << read.error().message;
  return read ? read->covariates.at(0) : Column{};
}

TEST(TimeField, IsSecondsSince1970) {
  const auto first = [](const char* field) { return timeIn({field, field}).first.value_or(-1.0); };
  for (const auto& [field, seconds] : {std::pair{"1970-01-02T00:00:01", 86'401.0},
                                       {"1970-01-02 00:00:01Z", 86'401.0},
                                       {"1970-01-01T02:00:00+02:00", 0.0},
                                       {"1970-01-01T02:00:00+0200", 0.0},
                                       {"1970-01-01 02:00:00 +02", 0.0},
                                       {"1970-01-01T02:00:00[Europe/Berlin]", 7200.0},
                                       {"1970-01-03", 172'800.0},
                                       {"03.01.1970", 172'800.0},
                                       {"03.01.70", 172'800.0},
                                       {"1/3/1970", 172'800.0},
                                       {"03.01.1970 00:01", 172'860.0},
                                       {"January 3, 1970", 172'800.0},
                                       {"3. Januar 1970", 172'800.0},
                                       {"3 gennaio 1970", 172'800.0},
                                       {"Sat, 03 Jan 1970 00:00:00 GMT", 172'800.0},
                                       {"1/3/1970 12:00:05 AM", 172'805.0},
                                       {"1970-01-01 00:00:00.250", 0.25},
                                       {"10:15:30.25", 36'930.25},
                                       {"10:15", 36'900.0},
                                       {"9:05:00", 32'700.0},
                                       {"12:00:00 AM", 0.0},
                                       {"12:30 PM", 45'000.0}})
    EXPECT_NEAR(first(field), seconds, 1e-6) << field;
}

TEST(TimeField, ThatIsNoneIsAnErrorWithItsFirstField) {
  for (const char* no : {"10:60:00", "10:00:00x", "1970-13-01T00:00:00", "1970-02-30", "1970-01-01x",
                         "32.01.1970", "yesterday", "1970-01-01T00:00:00+25:00"}) {
    const auto read = parseReadings(fmt::format("time;depth_mm\n{0};1500.5\n{0};1500.7\n", no), {}, "t.csv");
    ASSERT_FALSE(read) << no;
    EXPECT_THAT(read.error().message,
                HasSubstr(fmt::format("t.csv:2: \"{}\" in column \"time\" is not read as a time", no)));
  }
}

TEST(TimeField, OrderOfDayAndMonthIsThatInWhichTheDaysFollow) {
  EXPECT_NEAR(timeIn({"01/05/2026", "02/05/2026", "03/05/2026"}).values[2], 2 * 86'400.0, 1e-6)
      << "days of May";
  EXPECT_NEAR(timeIn({"05/01/2026", "05/02/2026", "05/13/2026"}).values[2], 12 * 86'400.0, 1e-6)
      << "there is no month 13";
}

TEST(TimeField, GoesOnOverMidnightButNotWhereItIsADuration) {
  EXPECT_NEAR(timeIn({"23:59:00", "00:01:00"}).values[1], 120.0, 1e-6);
  EXPECT_NEAR(timeIn({"23:59:00", "24:01:00"}).values[1], 120.0, 1e-6);
  EXPECT_NEAR(timeIn({"59:30.5", "59:31.0"}).values[1], 0.5, 1e-6) << "minutes and seconds";
}

TEST(TimeField, NumbersAreSecondsUnlessTheyCanOnlyBeADate) {
  EXPECT_EQ(timeIn({"0", "10", "20"}).values[2], 20.0);
  EXPECT_EQ(timeIn({"46143.25", "46143.75"}).values[1], 43'200.0);
  EXPECT_EQ(timeIn({"1777622280", "1777622290"}).values[1], 10.0);
  EXPECT_FALSE(epochOf({0.0, 46'143.0}, true)) << "from 0 on they are seconds";
}

std::string errorIn(const std::vector<std::string>& fields, const char* other = "7") {
  std::string text = "depth_mm;t_s\n";
  for (const std::string& field : fields) text += fmt::format("{};{}\n", field, other);
  const auto read = parseReadings(text, {}, "t.csv");
  return read ? fmt::format("{}", read->measured[0]) : read.error().message;
}

TEST(DecimalSign, IsThatOfFieldsThatAreCertain) {
  EXPECT_EQ(errorIn({"1,234", "1,5"}), "1.234");
  EXPECT_EQ(errorIn({"1,234", "1,234,567"}), "1234");
  EXPECT_EQ(errorIn({"1.234", "2.345"}), "1.234");
  EXPECT_EQ(errorIn({"1.234", "2.345"}, "0,5"), "1234") << "decimal signs are commas elsewhere";
  EXPECT_EQ(errorIn({"1,234", "2,345"}, "0.5"), "1234") << "points elsewhere";
  EXPECT_EQ(errorIn({"1,234", "2,345"}), "1.234") << "semicolons part columns where commas are decimal signs";
}

TEST(DecimalSign, ThatMayPartThousandsIsAnError) {
  EXPECT_THAT(errorIn({"950", "1,021"}),
              HasSubstr("t.csv:3: \"1,021\" in column \"depth_mm\" may be a thousand or a fraction"));
  EXPECT_THAT(errorIn({"1,5", "2,5", "3,5", "4,5", "1.25"}),
              HasSubstr("t.csv:6: \"1.25\" in column \"depth_mm\" has another decimal sign"));
}

TEST(FlagField, IsYesOrNo) {
  for (const char* yes : {"1", "yes", "TRUE", "ja", "oui", "sí", "1.0", "x"})
    EXPECT_EQ(flagIn(yes), true) << yes;
  for (const char* no : {"0", "no", "False", "nein", "", "0,0"}) EXPECT_EQ(flagIn(no), false) << no;
  EXPECT_FALSE(flagIn("22.7"));
}

}  // namespace
}  // namespace toftwin::table
