// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/characteristics.h"
#include "calib/compare/progress.h"
#include "calib/compare/report.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../matches.h"

namespace toftwin::compare {
namespace {

using testing::HasSubstr;
using testing::Not;

Report example() {
  Image<float> map(8, 4, 1.0F);
  map(3, 2) = std::nanf("");
  Report report{.title = "A <b> against C & D", .subtitle = "two cameras", .verdict = "they agree"};
  report.cards = {{.label = "bias", .value = "+1.0 mm", .note = "n = 3", .tone = Tone::Good}};
  const Plot plot{.title = "t",
                  .x_label = "x [mm]",
                  .y_label = "y [mm]",
                  .curves = {{.name = "measured", .x = {0, 1, 2}, .y = {1, std::nan(""), 3}}}};
  report.sections.push_back(
      {.id = "one",
       .title = "One",
       .verdict = "fine",
       .blocks = {
           Paragraph{"words"}, TableBlock{"numbers", {"what", "mm"}, {{"a", "−1.0"}, {"b", "2.0"}}},
           Figure{"a plot", toSvg(plot)},
           FigureRow{{{"a map", toSvg(ImageMap{.title = "m", .label = "mm", .values = map})}}},
           Details{"more", {"text"}}}});
  report.data.set("bias_mm", 1.0).set("nothing", std::nan(""));
  return report;
}

TEST(Report, NeedsNothingButItself) {
  const std::string page = toHtml(example());
  EXPECT_THAT(page, Not(HasSubstr("http")));
  EXPECT_THAT(page, Not(HasSubstr("src=")));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, Not(HasSubstr("<link")));
  EXPECT_THAT(page, Not(HasSubstr("@import")));
  // Every href is an anchor in the page or data in the page; every url() too.
  const auto references = test::matchesIn(page, "(href=|url\\()['\"]?([^'\")]{1,5})");
  for (const auto& reference : references)
    EXPECT_TRUE(reference[2].starts_with("#") || reference[2].starts_with("data:")) << reference[2];
  EXPECT_EQ(references.size(), 3U);  // one anchor, the map and its colour bar
}

/// A wall of 8 × 4 pixels that B sees 10 mm farther.
PoseComparison wall() {
  PoseComparison pose;
  pose.camera.width = 8, pose.camera.height = 4;
  pose.camera.fx = pose.camera.fy = 8.0, pose.camera.cx = 3.5, pose.camera.cy = 1.5;
  pose.range_a_mm = Image<float>(8, 4, 1000.0F), pose.difference_mm = Image<float>(8, 4, 10.0F);
  pose.valid_a = pose.valid_b = Image<float>(8, 4, 1.0F);
  pose.difference_mm(2, 1) = std::nanf("");
  return pose;
}

TEST(Report, HasAPointCloudThatOneCanTurnAndAStillOfIt) {
  const PointCloud cloud = pointCloudOf("wall", wall());
  ASSERT_EQ(cloud.a.size(), 31u) << "all but the pixel that is not compared";
  const auto length = [](const std::array<float, 3>& p) { return std::hypot(p[0], std::hypot(p[1], p[2])); };
  EXPECT_NEAR(length(cloud.a[0]), 1.0F, 1e-5F);
  EXPECT_NEAR(length(cloud.b[0]), 1.01F, 1e-5F);
  Report report = example();
  report.sections[0].blocks.push_back(cloud);
  const std::string page = toHtml(report);
  EXPECT_THAT(page, HasSubstr("<figure class='cloud alone' data-a='"));
  EXPECT_THAT(page, HasSubstr("<path class='dots simulated' d='M"));
  EXPECT_THAT(page, HasSubstr("<script>\n"));
  for (const char* elsewhere : {"http", "src=", "<link", "@import", "fetch("})
    EXPECT_THAT(page, Not(HasSubstr(elsewhere)));
}

TEST(Report, EscapesWhatItIsGiven) {
  const std::string page = toHtml(example());
  EXPECT_THAT(page, HasSubstr("A &lt;b&gt; against C &amp; D"));
  EXPECT_THAT(page, Not(HasSubstr("<b>")));
}

/// Names of seven cameras beside each other are else wider than a printed page.
TEST(Report, LetsNamesInATablesHeaderBreak) {
  Report report = example();
  report.sections[0].blocks.push_back(TableBlock{"", {"requirement", "azure_kinect_like"}, {{"a_b", "1"}}});
  const std::string page = toHtml(report);
  EXPECT_THAT(page, HasSubstr("azure_<wbr>kinect_<wbr>like</th>"));
  EXPECT_THAT(page, HasSubstr("<td>a_b</td>"));
}

/// In its column a reason is one word wide. On a page of Markdown it stays where it is.
TEST(Report, PutsALongReasonBelowItsRow) {
  Report report{.title = "t"};
  const std::string reason = "it may be a wave of 120 MHz, 1 per period, which these distances do not tell";
  report.sections.push_back(
      {.id = "s", .blocks = {TableBlock{"c", {"what", "verdict", "A"}, {{"wave", "not told: " + reason, ""}, {"x", "same", "3"}}}}});
  const std::string page = toHtml(report);
  EXPECT_THAT(page, HasSubstr("<tr class='above'><td>wave</td><td>not told</td><td></td></tr>"
                              "<tr class='below'><td colspan='3'>" + reason + "</td></tr>"));
  EXPECT_THAT(page, HasSubstr("<th class='number'>A</th>")) << "though the first row has none";
  EXPECT_THAT(toMarkdown(report), HasSubstr("| not told: " + reason + " |"));
}

TEST(Report, SetsNoNamesAsNumbers) {
  Report report{.title = "t"};
  report.sections.push_back(
      {.id = "s", .blocks = {TableBlock{"c", {"what", "A"}, {{"16 MHz", "1"}, {"drift", "–"}, {"wraps", "words"}}}}});
  const std::string page = toHtml(report);
  EXPECT_THAT(page, HasSubstr("<td>16 MHz</td><td class='number'>1</td>"));
  EXPECT_THAT(page, HasSubstr("<td>words</td>"));
}

/// As a table of few rows stays on one page, which a longer one may not.
TEST(Report, KeepsOnPaperTogetherWhatBelongsTogether) {
  Report report{.title = "t"};
  TableBlock table{"c", {"pose", "bias [mm]"}, {{"a ± b", "−2.77 ± 0.27"}}};
  report.sections.push_back({.id = "s", .blocks = {table}});
  table.rows.resize(9, {"c", "1"});
  report.sections[0].blocks.push_back(table);
  const std::string page = toHtml(report);
  EXPECT_THAT(page, HasSubstr("<td>a ± b</td><td class='number'>−2.77&nbsp;±&nbsp;0.27</td>"));
  EXPECT_EQ(page.find("<table class='few'>"), page.rfind("<table class='few'>"));
  EXPECT_LT(page.find("<table class='few'>"), page.find("<table>"));
  EXPECT_NE(page.find("<table>"), std::string::npos);
}

/// A panel of what is left is 76 pixels high.
TEST(Plot, HasThreeTicksOnEachAxis) {
  for (const auto& [low, high] : {std::pair{-5.5, 5.2}, {-0.03, 0.055}, {0.97, 1.03}, {-10.4, 16.1}}) {
    for (const bool log : {false, true}) {
      if (log && low <= 0.0) continue;
      const Curve curve{.x = {0.0, 1.0}, .y = {low, high}};
      const std::string svg =
          toSvg(Plot{.curves = {curve}, .compact = true, .below = Panel{.curves = {curve}, .log_y = log}});
      const auto panel = svg.find("text-anchor='end'", svg.rfind("class='frame'", svg.rfind("class='frame'") - 1));
      std::size_t ticks = 0;
      for (auto at = panel; at != std::string::npos; at = svg.find("text-anchor='end'", at + 1)) ++ticks;
      EXPECT_GE(ticks, 3u) << low << " to " << high;
    }
  }
}

TEST(Report, HasInItsWordsWhatIsClosedOnThePage) {
  EXPECT_THAT(toMarkdown(example()), HasSubstr("more:\n\n- text\n"));
}

TEST(Report, IsWrittenWithItsNumbers) {
  const auto folder = std::filesystem::path{testing::TempDir()} / "report_test" / "deep";
  std::filesystem::remove_all(folder);
  const auto page = write(example(), folder);
  ASSERT_TRUE(page.ok()) << page.error().message;
  EXPECT_TRUE(page->is_absolute());
  std::ifstream in{folder / "report.json"};
  const std::string json{std::istreambuf_iterator<char>{in}, {}};
  EXPECT_EQ(json, "{\n  \"bias_mm\": 1,\n  \"nothing\": null\n}\n");
}

TEST(Report, SaysWhichFolderItCannotWrite) {
  const auto page = write(example(), "/proc/no/report");
  ASSERT_FALSE(page.ok());
  EXPECT_THAT(page.error().message, HasSubstr("/proc/no/report"));
}

TEST(Numbers, AreShownForPeople) {
  EXPECT_EQ(shown(-1.25), "−1.2");
  EXPECT_EQ(shown(-0.01), "0.0");
  EXPECT_EQ(shown(std::nan("")), "–");
  EXPECT_EQ(shownWithError(3.14159, 0.1), "+3.1 ± 0.1");
  EXPECT_EQ(shownWithError(3.14159, 0.003, 2), "+3.142 ± 0.003") << "an error is not 0.00";
  EXPECT_EQ(shownWithError(0.0, 0.0, 2), "0");
  EXPECT_EQ(shownWithError(-1.5, 0.0, 1), "−1.5 ± 0");
  EXPECT_EQ(shownPercent(0.426), "43 %");
  EXPECT_EQ(shownDigits(-3.97e-6, 3), "−3.97·10⁻⁶");
  EXPECT_EQ(shownDigits(1.2345e12, 3), "1.23·10¹²");
  EXPECT_EQ(shownDigits(-0.125, 3), "−0.125");
}

TEST(Ticks, AreRoundAndInside) {
  EXPECT_EQ(roundTicks(-1.0, 11.0, 6), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_TRUE(roundTicks(1.0, 1.0, 5).empty());
  EXPECT_EQ(tickLabels(roundTicks(10800.09, 10800.17, 4)),
            (std::vector<std::string>{"10800.1", "10800.12", "10800.14", "10800.16"}));
  EXPECT_EQ(tickLabels({-0.5, 0.0, 0.5}), (std::vector<std::string>{"−0.5", "0", "0.5"}));
}

TEST(Pace, FollowsAJobThatBecomesSlower) {
  Pace pace;
  EXPECT_FALSE(pace.left(10.0)) << "nothing is known yet";
  double seconds = 0.0, done = 0.0;
  for (; done < 100.0; done += 1.0) pace.at(seconds += 0.1, done);
  EXPECT_NEAR(*pace.left(100.0), 10.0, 0.5);
  // Ten times slower from here on: what began fast counts for less and less.
  for (int i = 0; i < 60; ++i) pace.at(seconds += 1.0, done += 1.0);
  EXPECT_GT(*pace.left(100.0), 85.0) << "the mean of all the job would say 44 s";
  EXPECT_EQ(*pace.left(0.0), 0.0);
}

TEST(Pace, TrustsThePlanAtFirst) {
  Pace pace{1.0, 10.0};
  EXPECT_DOUBLE_EQ(*pace.left(30.0), 30.0);
  for (int i = 1; i <= 200; ++i) pace.at(0.1 * i, 0.01 * i);  // ten times slower than planned
  EXPECT_GT(*pace.left(30.0), 150.0);
}

TEST(Plot, InterruptsACurveWhereThereIsNoValue) {
  const Plot plot{.title = "t",
                  .x_label = "x",
                  .y_label = "y",
                  .curves = {{.name = "c", .x = {0, 1, 2, 3}, .y = {1, std::nan(""), 3, 4}}}};
  const std::string svg = toSvg(plot);
  const auto d = svg.substr(svg.find("d='M"), 60);
  EXPECT_EQ(std::count(d.begin(), d.begin() + static_cast<long>(d.find("'/>")), 'M'), 2) << d;
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

/// 10800.1 in the middle below its line was "10800.", cut off at the picture's edge.
TEST(Plot, KeepsItsLastNumberWithinThePicture) {
  const auto of = [](double from, double to) {
    return toSvg(Plot{
        .title = "t", .x_label = "x", .y_label = "y", .curves = {{.name = "c", .x = {from, to}, .y = {1, 2}}}});
  };
  EXPECT_NE(of(10800.0, 10800.1).find("text-anchor='end'>10800.1</text>"), std::string::npos);
  EXPECT_NE(of(0.0, 2.0).find("text-anchor='middle'>2</text>"), std::string::npos);
}

TEST(Plot, DrawsNoBandWhereTheErrorIsUnknown) {
  const double unknown = std::nan("");
  const Plot plot{.title = "t",
                  .x_label = "x",
                  .y_label = "y",
                  .curves = {{.name = "c",
                              .x = {0, 1, 2, 3, 4},
                              .y = {1, 2, 3, 4, 5},
                              .low = {0, 1, unknown, 3, 4},
                              .high = {2, 3, unknown, 5, 6}}}};
  const std::string svg = toSvg(plot);
  const std::size_t begin = svg.find("d='", svg.find("class='band"));
  const std::string d = svg.substr(begin, svg.find("'/>", begin) - begin);
  EXPECT_EQ(std::count(d.begin(), d.end(), 'M'), 2) << d;
  EXPECT_EQ(std::count(d.begin(), d.end(), 'Z'), 2) << d;
}

TEST(Histogram, CountsEveryFiniteValueOnce) {
  const Curve curve = histogram(std::vector<double>{-5, 0.5, 1.5, 1.6, 9, std::nan("")}, 0, 2, 2,
                                "h", Ink::Measured);
  EXPECT_EQ(curve.y, (std::vector<double>{0, 2, 3, 0}));
}

TEST(Base64, IsThatOfRfc4648) {
  const auto of = [](std::string_view text) {
    return base64({reinterpret_cast<const unsigned char*>(text.data()), text.size()});
  };
  EXPECT_EQ(of(""), "");
  EXPECT_EQ(of("f"), "Zg==");
  EXPECT_EQ(of("fo"), "Zm8=");
  EXPECT_EQ(of("foobar"), "Zm9vYmFy");
}

TEST(Json, EscapesAndKeepsOrder) {
  Json json = Json::object();
  json.set("b", "a\"\\\n").set("a", Json::arrayOf(std::vector<double>{1, 0.5})).set("t", true);
  EXPECT_EQ(json.text(),
            "{\n  \"b\": \"a\\\"\\\\\\u000a\",\n  \"a\": [1, 0.5],\n  \"t\": true\n}\n");
}

}  // namespace
}  // namespace toftwin::compare
