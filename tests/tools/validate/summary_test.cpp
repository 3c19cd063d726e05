// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/settings/settings.h"
#include "tools/validate/validate.h"

namespace toftwin::validate {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string textOf(const std::filesystem::path& file) {
  std::ifstream in{std::filesystem::path{TOFTWIN_SOURCE_DIR} / file};
  EXPECT_TRUE(in) << file;
  return {std::istreambuf_iterator<char>{in}, {}};
}

TEST(Documents, ReadmesResultsAreThoseOfTheReportThatIsCommitted) {
  const std::string readme = textOf("README.md"), results = textOf("docs/results.md");
  const std::string from = "<!-- results: copied from docs/results.md -->\n", to = "<!-- end -->";
  const std::size_t begin = readme.find(from);
  ASSERT_NE(begin, std::string::npos) << from;
  const std::size_t end = readme.find(to, begin);
  ASSERT_NE(end, std::string::npos) << to;
  const std::string copy = readme.substr(begin + from.size(), end - begin - from.size());
  EXPECT_THAT(copy, HasSubstr("| Kinect v2, corner |"));
  EXPECT_NE(results.find(copy), std::string::npos)
      << "README.md holds other results than docs/results.md:\n"
      << copy;
}

/// Each number that the page says was measured or simulated stands in the results of that camera.
TEST(Documents, PublishedErrorsStandBesideFiguresOfTheResults) {
  const std::string page = textOf("docs/published-errors.md"), results = textOf("docs/results.md");
  const std::regex number{"(−)?[0-9]+(\\.[0-9]+)?"};
  const auto numbersOf = [&](const std::string& text) {
    std::set<std::string> numbers;
    for (std::sregex_iterator i{text.begin(), text.end(), number}, end; i != end; ++i) numbers.insert(i->str());
    return numbers;
  };
  const auto ofCamera = [&](const std::string& camera) {
    std::string text, section;
    std::istringstream lines{results};
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("## ")) section = line;
      if ((section + line).find(camera) != std::string::npos) text += line + "\n";
    }
    return numbersOf(text);
  };
  std::set<std::string> known;
  std::istringstream lines{page.substr(page.find("<!-- figures of docs/results.md -->"))};
  int count = 0;
  for (std::string line; std::getline(lines, line) && line != "<!-- end -->";) {
    std::vector<std::string> cells;
    std::istringstream row{line};
    for (std::string cell; std::getline(row, cell, '|');) cells.push_back(cell);
    if (cells.size() < 7 || cells[4] == " measured ") continue;
    if (cells[1] != " ") known = ofCamera(cells[1].substr(1, cells[1].size() - 2));
    for (std::size_t column = 4; column < 7; ++column) {
      for (const std::string& one : numbersOf(cells[column])) {
        EXPECT_TRUE(known.contains(one)) << one << " of: " << line;
        ++count;
      }
    }
  }
  EXPECT_GT(count, 50);
}

TEST(Documents, ResultsAreAReportOfThisProgramsForm) {
  // Tables that this program would write, without their rows: none may be missing or have other columns.
  const std::string results = textOf("docs/results.md");
  const auto described = settings::Table::load(std::filesystem::path{TOFTWIN_SOURCE_DIR} / "tools/validate/datasets/tof-thesis-2018/dataset.toml");
  ASSERT_TRUE(described.ok());
  auto table = *described;
  const compare::Report empty{.title = table.text("title").value(), .sections = {summarySection({}, table.text("other").value())}};
  std::istringstream lines{toMarkdown(empty)};
  int headers = 0;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("| ") || line.starts_with("| ---")) continue;
    EXPECT_THAT(results, HasSubstr(line + "\n"));
    ++headers;
  }
  EXPECT_EQ(headers, 2);
  EXPECT_TRUE(results.starts_with("# " + empty.title + "\n\ntoftwin "));
}

TEST(Summary, NamesTheEffectsThatCount) {
  Judged a, b;
  a.ablations = {{"multipath", "corner", 4.0, 10.0}, {"delay", "corner", 4.0, 5.9}};
  b.ablations = {{"multipath", "box", 2.0, 3.0}, {"scatter", "plate", 1.0, 5.0}, {"defocus", "edge", 2.0, 1.1}};
  a.outcomes = {{.data = "corner", .as_is_mm = 6.0, .fitted_mm = 4.0}};
  b.outcomes = {{.data = "edge", .as_is_mm = 1.6, .fitted_mm = 2.0}};
  const compare::Section section = summarySection({a, b}, "other simulator");
  EXPECT_THAT(std::get<compare::Paragraph>(section.blocks.at(2)).text,
              AllOf(HasSubstr("(from 1.5 on): multipath (corner 2.5; box 1.5), scatter (plate 5.0). Better"),
                    HasSubstr("Better without: defocus (edge 0.55). The judged"),
                    HasSubstr("than by the preset as is: edge (2.0 for 1.6).")));
}

}  // namespace
}  // namespace toftwin::validate
