// SPDX-License-Identifier: Apache-2.0
// The report's page in a real browser: its script runs, and it can be photographed and printed.
#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include "calib/compare/plot.h"
#include "calib/compare/report.h"

namespace toftwin::compare {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

class Browser : public testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v chromium > /dev/null") != 0) GTEST_SKIP() << "no chromium here";
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  /// What it prints. Nothing of its own business goes to a network.
  std::string chromium(const std::string& arguments) const {
    const auto out = folder_ / "out";
    const std::string command = fmt::format(
        "timeout 60 chromium --headless --no-sandbox --disable-gpu --no-first-run "
        "--disable-background-networking "
        "--disable-component-update --disable-sync --user-data-dir={0}/profile {1} file://{0}/index.html > "
        "{2} 2> {0}/err",
        folder_.string(), arguments, out.string());
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    std::stringstream text;
    text << std::ifstream{out}.rdbuf();
    return text.str();
  }
  fs::path folder_ = fs::temp_directory_path() / fmt::format("toftwin_browser_{}", getpid());
};

/// A wall 1 m ahead, B's 10 cm behind.
PointCloud walls() {
  PointCloud cloud{.caption = "two walls"};
  for (int y = -20; y < 20; ++y) {
    for (int x = -20; x < 20; ++x) {
      cloud.a.push_back({0.02F * static_cast<float>(x), 0.02F * static_cast<float>(y), 1.0F});
      cloud.b.push_back({0.02F * static_cast<float>(x), 0.02F * static_cast<float>(y), 1.1F});
    }
  }
  return cloud;
}

TEST_F(Browser, TurnsThePointCloudsAndPrintsThePage) {
  Report report{.title = "A page", .subtitle = "of a test", .verdict = "fine"};
  report.sections.push_back(
      {.id = "one",
       .title = "One",
       .verdict = "fine",
       .blocks = {Paragraph{"words"}, walls(), Details{"more", {"what is closed on the screen"}}}});
  ASSERT_TRUE(write(report, folder_));
  const std::string page = chromium("--dump-dom");
  // The script comes to its end: the still is a canvas then, and the cloud says that it turns.
  EXPECT_THAT(page, HasSubstr("<canvas"));
  EXPECT_THAT(page, HasSubstr("class=\"cloud alone turns\""));
  chromium(fmt::format("--window-size=900,900 --screenshot={}/page.png", folder_.string()));
  EXPECT_GT(fs::file_size(folder_ / "page.png"), 10'000U);
  chromium(fmt::format("--no-pdf-header-footer --print-to-pdf={}/page.pdf", folder_.string()));
  EXPECT_GT(fs::file_size(folder_ / "page.pdf"), 10'000U);
}

/// Printed, the canvas has another shape than the one that it was drawn for: a room was 1.7 times as wide.
TEST_F(Browser, KeepsThePointCloudsShapeWhereItsBoxChanges) {
  Report report{.title = "A page", .subtitle = "of a test", .verdict = "fine"};
  report.sections.push_back({.id = "one", .title = "One", .blocks = {walls()}});
  ASSERT_TRUE(write(report, folder_));
  std::ofstream{folder_ / "index.html", std::ios::app}
      << "<script>document.title = `shape ${getComputedStyle(document.querySelector('canvas')).objectFit}`;</script>";
  EXPECT_THAT(chromium("--window-size=900,900 --dump-dom"), HasSubstr("<title>shape contain</title>"));
}

/// A plot with what is left below it was 1200 pixels high on a page 1500 wide.
TEST_F(Browser, ShowsAPlotThatStandsAloneAtOneGlance) {
  Plot plot{.title = "A plot", .x_label = "x", .y_label = "y"};
  plot.curves.push_back({.name = "A", .x = {0.0, 1.0}, .y = {0.0, 1.0}});
  plot.below = Panel{.y_label = "rest", .curves = plot.curves};
  Report report{.title = "A page", .subtitle = "of a test", .verdict = "fine"};
  report.sections.push_back({.id = "one", .title = "One", .blocks = {Figure{"what it shows", toSvg(plot)}}});
  ASSERT_TRUE(write(report, folder_));
  std::ofstream{folder_ / "index.html", std::ios::app}
      << "<script>const at = one => document.querySelector(one).getBoundingClientRect();"
         "document.title = `plot ${at('.plot').height < 650}, beside ${at('figcaption').left > at('.plot').right}`;"
         "</script>";
  EXPECT_THAT(chromium("--window-size=1500,1000 --dump-dom"), HasSubstr("<title>plot true, beside true</title>"));
}

}  // namespace
}  // namespace toftwin::compare
