// SPDX-License-Identifier: Apache-2.0
// What is left below a plot: rows that are paired, and a band for what of it is noise.
#include "calib/compare/residual.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>

#include "../matches.h"
#include "calib/compare/fitted_figure.h"

namespace toftwin::compare {
namespace {

using testing::HasSubstr;
using testing::Not;

int count(const std::string& text, const std::string& part) {
  int found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

/// 400 rows of a curve of 50 mm with noise of 1 mm, out of order.
TEST(Rest, BandIsTheNoiseWhateverCurveTheRowsFollow) {
  std::mt19937_64 random{1};
  std::normal_distribution<double> noise{0.0, 1.0};
  std::vector<double> x, rest;
  for (int i = 0; i < 400; ++i) {
    x.push_back((i * 7) % 400);
    rest.push_back(50.0 * std::sin(x.back() / 100.0) + noise(random));
  }
  const Panel panel = restPanel("B − A [mm]", x, rest);
  ASSERT_EQ(panel.curves.size(), 2u);
  const Curve& band = panel.curves[0];
  EXPECT_EQ(panel.curves[1].y.size(), 400u);
  EXPECT_TRUE(std::ranges::is_sorted(panel.curves[1].x));
  EXPECT_DOUBLE_EQ(band.x.front(), 0.0);
  EXPECT_DOUBLE_EQ(band.x.back(), 399.0);
  // Eight groups of 50 rows tell σ to √(3/(4·50)) = 12 % each; the curve adds 0.5²/2 mm² at most, 6 %.
  for (std::size_t i = 0; i < band.x.size(); ++i) {
    EXPECT_NEAR(band.high[i], 1.96, 1.96 * (4.0 * 0.12 + 0.06));
    EXPECT_DOUBLE_EQ(band.low[i], -band.high[i]);
  }
}

TEST(Rest, OfRatiosIsAsFarAboveOneAsBelow) {
  std::vector<double> x, ratio;
  for (int i = 0; i < 12; ++i) x.push_back(i), ratio.push_back(i % 2 == 0 ? 2.0 : 0.5);
  ratio[3] = -1.0;  // has no logarithm: left out
  const Panel panel = restPanel("B / A", x, ratio, Rest::Ratio);
  EXPECT_TRUE(panel.log_y);
  EXPECT_DOUBLE_EQ(panel.zero, 1.0);
  EXPECT_EQ(panel.curves.at(1).y.size(), 11u);
  // Neighbours differ by ln 4, nine times of ten.
  const double sigma = std::log(4.0) * std::sqrt(9.0 / 10.0 / 2.0);
  EXPECT_NEAR(panel.curves[0].high[0], std::exp(1.96 * sigma), 1e-9);
  EXPECT_NEAR(panel.curves[0].low[0] * panel.curves[0].high[0], 1.0, 1e-12);
}

TEST(Rest, OfFewRowsHasNoBand) {
  const std::vector<double> x{1, 2, 3, 4, 5, 6, 7};
  EXPECT_EQ(restPanel("B − A", x, x).curves.size(), 1u);
}

TEST(Rest, BelowAPlotHasTheSameAbscissaOnce) {
  Plot plot{.title = "t", .x_label = "distance [m]", .y_label = "error [mm]"};
  plot.curves = {{.name = "measured", .x = {10, 20, 30}, .y = {1, 2, 3}}};
  const std::string alone = toSvg(plot);
  plot.below = measuredLess(plot.curves[0].x, plot.curves[0].y, std::vector<double>{1.5, 1.5, 1.5});
  const std::string both = toSvg(plot);
  EXPECT_EQ(count(both, "class='frame'"), 2);
  EXPECT_EQ(count(both, "distance [m]"), 1);
  EXPECT_EQ(count(both, "measured − simulated [mm]"), 1);
  const std::string tick = "text-anchor='middle'>20</text>";
  EXPECT_EQ(count(alone, tick), 1);
  EXPECT_EQ(count(both, tick), 1);
  EXPECT_THAT(both, Not(HasSubstr("nan")));
}

NamedTraits rowsOf(std::vector<std::size_t> of_a, std::vector<std::size_t> of_b) {
  NamedTraits traits;
  traits.rows = {{"drift", "A", {0, 1, 2, 3}, {5, 6, 7, 8}, std::move(of_a)},
                 {"drift", "B", {3, 2, 1, 0}, {8.5, 7.5, 6.5, 5.5}, std::move(of_b)}};
  return traits;
}

TEST(FittedFigure, PairsRowsOfTheSameCondition) {
  const auto paired = fittedFigure(rowsOf({1, 2, 3, 4}, {4, 3, 2, 1}), "drift", {.title = "d"});
  ASSERT_TRUE(paired);
  // All four are +0.5, so that the lower axis is about it: pairs by the row's number would be 3.5, 1.5, −0.5 and −2.5.
  std::map<std::string, int> heights;
  for (const auto& dot : test::matchesIn(paired->svg, "<circle[^>]*cy='([0-9.]+)'")) ++heights[dot[1]];
  EXPECT_TRUE(std::ranges::any_of(heights, [](const auto& one) { return one.second >= 4; }));
  EXPECT_EQ(count(paired->svg, "<circle"), 4 + 4 + 4 + 2 * 3) << "and two in each of three legends";
  const auto others = fittedFigure(rowsOf({1, 2, 3, 4}, {5, 6, 7, 8}), "drift", {.title = "d"});
  ASSERT_TRUE(others);
  EXPECT_THAT(others->svg, Not(HasSubstr("B − A")));
  EXPECT_FALSE(fittedFigure(rowsOf({1, 2, 3, 4}, {4, 3, 2, 1}), "lag", {}));
}

TEST(FittedFigure, WithoutConditionsHoldsBAgainstAsCurve) {
  NamedTraits traits = rowsOf({}, {});
  traits.rows[0].curve = {"ramp", [](double x) { return 5.0 + x; }};
  traits.rows[1].x = {-1.0, 0.5, 1.5, 2.5};  // the first is beyond A's rows
  const auto figure = fittedFigure(traits, "drift", {.title = "d"});
  ASSERT_TRUE(figure);
  EXPECT_THAT(figure->svg, HasSubstr("A: ramp"));
  EXPECT_THAT(figure->svg, HasSubstr("B − A&#39;s curve [mm]"));
  EXPECT_EQ(count(figure->svg, "<circle"), 4 + 4 + 3 + 2 * 3);
}

}  // namespace
}  // namespace toftwin::compare
