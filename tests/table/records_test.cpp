// SPDX-License-Identifier: Apache-2.0
// From bytes to rows and columns, and what is said of texts that are no tables.
#include <gmock/gmock.h>

#include "calib/table/table.h"

namespace toftwin::table {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;

std::string errorOf(const std::string& text) {
  const auto table = parseTable(text, "t.csv");
  return table ? "no error" : table.error().message;
}

std::vector<std::string> headerOf(const std::string& text) {
  const auto table = parseTable(text, "t.csv");
  return table ? table->headers() : std::vector<std::string>{table.error().message};
}

TEST(ParseTable, ReadsQuotesSemicolonsTabsCommentsAndWindowsLines) {
  const auto table =
      parseTable("\xEF\xBB\xBF# made by hand\r\na;\"b;c\"\r\n1; \"say \"\"x\"\"\"\r\n\r\n2;y\r\n", "t.csv");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_THAT(table->headers(), ElementsAre("a", "b;c"));
  EXPECT_EQ(table->text(1, 0), "say \"x\"");
  EXPECT_THAT(table->line, ElementsAre(3u, 5u));
  EXPECT_EQ(headerOf("a\tb\n1\t2\n").size(), 2u);
  EXPECT_THAT(parseTable("a,b\r1,2\r\r3,4\r", "t.csv")->line, ElementsAre(2u, 4u)) << "old Macs' lines";
  EXPECT_THAT(parseTable("a,b\r\r\n1,2\r\r\n3,4\r\r\n", "t.csv")->line, ElementsAre(2u, 3u))
      << "converted twice";
}

TEST(ParseTable, CountsLinesInsideQuotes) {
  const auto table = parseTable("a,b\n1,\"x\ny\"\n2,z\n", "t.csv");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_EQ(table->text(1, 0), "x\ny");
  EXPECT_THAT(table->line, ElementsAre(2u, 4u));
}

TEST(ParseTable, TakesTheSeparatorThatExcelSays) {
  EXPECT_THAT(headerOf("sep=;\na,b;c\n1,5;2\n"), ElementsAre("a,b", "c"));
  EXPECT_THAT(parseTable("sep=;\na,b;c\n1,5;2\n", "t.csv")->line, ElementsAre(3u));
}

/// 0xB0 is the degree sign and 0x80 the euro sign there; alone they are no UTF-8.
TEST(ParseTable, ReadsWindows1252AsUtf8AndKeepsUtf8) {
  const auto old = parseTable("T [\xB0\x43],\x80\n1,2\n", "t.csv"),
             now = parseTable("T [\xC2\xB0\x43],\xE2\x82\xAC\n1,2\n", "t.csv");
  ASSERT_TRUE(old && now);
  EXPECT_EQ(old->headers(), now->headers());
  EXPECT_EQ(now->columns[0].unit, "degC");
  EXPECT_THAT(old->notes, ElementsAre(HasSubstr("Windows-1252")));
  EXPECT_THAT(now->notes, testing::IsEmpty());
}

TEST(ParseTable, SaysWhichLineIsWrongAndHow) {
  EXPECT_THAT(errorOf("a,b\n1,2\n3\n"), HasSubstr("t.csv:3: has 1 field, but the header has 2"));
  EXPECT_THAT(errorOf("a,b\n1,1500,25\n"),
              HasSubstr("t.csv:2: has 3 fields, but the header has 2; commas in its"));
  EXPECT_THAT(errorOf("a;b\n1;2;3\n"), EndsWith("t.csv:2: has 3 fields, but the header has 2"));
  EXPECT_THAT(errorOf("a,b\n1,\"2\n"), HasSubstr("t.csv:2: a quote is opened and never closed"));
  EXPECT_THAT(errorOf(""), HasSubstr("is empty"));
  EXPECT_THAT(errorOf("a,b\n"), HasSubstr("has a header but no rows"));
  EXPECT_THAT(errorOf(std::string("a,b\n1,\0\n", 8)), HasSubstr("zero bytes"));
  EXPECT_THAT(errorOf("PK\x03\x04..."), HasSubstr("spreadsheet"));
  EXPECT_THAT(errorOf("a,b\n1,2\n3,4\n5"), HasSubstr("t.csv:4: has 1 field")) << "the file was cut off";
}

TEST(ParseTable, FindsTheLineOfNamesAboveTheNumbers) {
  EXPECT_THAT(headerOf("Lab 3\nRun 5\n\nt_s,d_mm\n0,1\n1,2\n"), ElementsAre("t_s", "d_mm"));
  EXPECT_THAT(headerOf("a,b\nleft camera,right camera\n0,1\n1,2\n"),
              ElementsAre("left camera", "right camera"))
      << "the line directly above the numbers";
  EXPECT_THAT(headerOf("# t_s d_mm\n0 1\n1 2\n"), ElementsAre("t_s", "d_mm"));
  EXPECT_THAT(headerOf("time [s]   depth of wall [mm]\n0   1.5\n1   2.5\n"),
              ElementsAre("time [s]", "depth of wall [mm]"));
  EXPECT_THAT(headerOf("#N/A,1\n"), ElementsAre("", "")) << "a field, no comment";
  const auto without = parseTable("0,1\n1,2\n", "t.csv");
  ASSERT_TRUE(without);
  EXPECT_FALSE(without->has_header);
  EXPECT_EQ(without->rows(), 2u);
}

TEST(ParseTable, KeepsARowWithAMistakeAboveTheFirstGoodOne) {
  const auto table = parseTable("t_s,d_mm\nx7,1\n1,2\n2,3\n3,4\n4,5\n", "t.csv");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_EQ(table->rows(), 5u);
  EXPECT_THAT(table->numbers(0).error().message,
              HasSubstr("t.csv:2: \"x7\" in column \"t_s\" is not a number"));
}

TEST(ParseTable, TakesALineOfUnits) {
  const auto table = parseTable("time;depth;lamp\n[s];[mm];-\n0;1;on\n1;2;off\n", "t.csv");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_EQ(table->columns[0].unit, "s");
  EXPECT_EQ(table->columns[1].unit, "mm");
  EXPECT_EQ(table->columns[2].unit, "");
  EXPECT_EQ(table->rows(), 2u);
}

TEST(ParseTable, AColumnAloneIsATable) {
  const auto table = parseTable("start_s\n0.5\n1.5\n", "t.csv");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_EQ(table->columns.size(), 1u);
  EXPECT_EQ(parseTable("value_mm\n1500,3\n1501,4\n", "t.csv")->columns[0].values[1], 1501.4);
}

TEST(ParseTable, NamesAtWideGapsMayBeQuoted) {
  const auto table = parseTable("wall time  the \"\"true\"\" depth\n1 1500\n2 1501\n", "t.csv");
  ASSERT_TRUE(table) << table.error().message;
  ASSERT_EQ(table->columns.size(), 2u);
  EXPECT_EQ(table->columns[0].header, "wall time");
  // A field with doubled quotes lies in memory of its own, which only an address sanitizer sees crossed.
  EXPECT_TRUE(parseTable("a b \"say \"\"c\"\" to me\" d\n1 2\n3 4\n", "t.csv").ok());
}

TEST(ParseTable, NamesColumnsThatAreMissingOrDoubled) {
  const auto table = parseTable("a,a,b\n1,2,3\n", "t.csv");
  ASSERT_TRUE(table);
  EXPECT_THAT(table->find("c").error().message, HasSubstr("t.csv: has no column \"c\", only: a, a, b"));
  EXPECT_THAT(table->find("a").error().message, HasSubstr("two columns \"a\""));
  EXPECT_EQ(table->find("b").value(), 2u);
}

TEST(UnitOfHeader, IsFoundInEveryUsualWriting) {
  for (const char* header :
       {"depth_mm", "depth [mm]", "depth (mm)", "depth, mm", "depth/mm", "depth / mm", "depth in mm",
        "depthMm", "depth mm", "Depth_MM", "depth.mm", "depth_mm_left", "depth [mm] (left)"}) {
    const auto table =
        parseTable(std::string{header[5] == ',' ? "\"depth, mm\"" : header} + ";t\n1;2\n", "t.csv");
    ASSERT_TRUE(table) << table.error().message;
    EXPECT_EQ(table->columns[0].unit, "mm") << header;
  }
  for (const auto& [header, unit] : {std::pair{"temperature_c", "degC"},
                                     {"T [°C]", "degC"},
                                     {"speed_m_per_s", "m_per_s"},
                                     {"v [m/s]", "m_per_s"},
                                     {"tilt_deg", "deg"},
                                     {"mm_std", ""},
                                     {"depth_std", ""},
                                     {"t_raw", ""}}) {
    EXPECT_EQ(parseTable(std::string{header} + ";a\n1;2\n", "t.csv")->columns[0].unit, unit) << header;
  }
}

}  // namespace
}  // namespace toftwin::table
