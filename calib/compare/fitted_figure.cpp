// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/fitted_figure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <fmt/format.h>

namespace toftwin::compare {
namespace {

constexpr std::array kOf{"A", "B"};
constexpr std::array kInkOf{Ink::Measured, Ink::Simulated};
constexpr std::array kStrokeOf{Stroke::Line, Stroke::Dashed};
constexpr std::size_t kFewestDrawn = 3;
constexpr int kCurvePoints = 240;

const NamedRows* rowsOf(const NamedTraits& traits, const std::string& what, std::string_view of) {
  const auto found = std::ranges::find_if(
      traits.rows, [&](const NamedRows& one) { return one.what == what && one.of == of; });
  return found == traits.rows.end() || found->x.size() < kFewestDrawn ? nullptr : &*found;
}

/// The fitted curve over the range of its rows.
Curve curveThrough(const NamedRows& rows, std::size_t camera, bool log_x) {
  Curve curve{.name = fmt::format("{}: {}", kOf[camera], rows.curve.name),
              .ink = kInkOf[camera],
              .stroke = kStrokeOf[camera]};
  const auto [first, last] = std::ranges::minmax(rows.x);
  for (int i = 0; i <= kCurvePoints; ++i) {
    const double share = static_cast<double>(i) / kCurvePoints;
    curve.x.push_back(log_x ? first * std::pow(last / first, share) : first + share * (last - first));
    curve.y.push_back(rows.curve.at(curve.x.back()));
  }
  return curve;
}

/// Rows of A and B at the same condition, at A's x; without conditions B's rows and A's curve.
std::optional<Panel> panelBelow(const NamedRows& a, const NamedRows& b, const FigureWords& words) {
  const bool is_ratio = words.log_y;
  std::vector<double> x, rest;
  const auto add = [&](double at, double of_a, double of_b) {
    x.push_back(at), rest.push_back(is_ratio ? of_b / of_a : of_b - of_a);
  };
  std::map<std::size_t, double> of_b;
  for (std::size_t i = 0; i < b.condition.size(); ++i) of_b[b.condition[i]] = b.y[i];
  for (std::size_t i = 0; i < a.condition.size(); ++i) {
    if (const auto found = of_b.find(a.condition[i]); found != of_b.end()) add(a.x[i], a.y[i], found->second);
  }
  const auto [first, last] = std::ranges::minmax(a.x);
  const bool by_curve = a.condition.empty() && a.curve.at;
  for (std::size_t i = 0; by_curve && i < b.x.size(); ++i) {
    if (b.x[i] >= first && b.x[i] <= last) add(b.x[i], a.curve.at(b.x[i]), b.y[i]);
  }
  if (x.size() < kFewestDrawn) return std::nullopt;
  const std::string left = is_ratio ? "B / A" : by_curve ? "B − A's curve" : "B − A";
  const bool has_unit = !is_ratio && !words.rest_unit.empty();
  return restPanel(has_unit ? fmt::format("{} [{}]", left, words.rest_unit) : left, x, rest,
                   is_ratio ? Rest::Ratio : Rest::Difference);
}

}  // namespace

std::optional<Figure> fittedFigure(const NamedTraits& traits, const std::string& what,
                                   const FigureWords& words) {
  const std::array rows{rowsOf(traits, what, kOf[0]), rowsOf(traits, what, kOf[1])};
  if (rows[0] == nullptr && rows[1] == nullptr) return std::nullopt;
  Plot plot{.title = words.title,
            .x_label = words.x_label,
            .y_label = words.y_label,
            .zero_line = true,
            .log_y = words.log_y,
            .compact = words.compact,
            .log_x = words.log_x};
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    if (rows[camera] == nullptr) continue;
    plot.curves.push_back({.name = kOf[camera],
                           .x = rows[camera]->x,
                           .y = rows[camera]->y,
                           .ink = kInkOf[camera],
                           .stroke = Stroke::Dots});
  }
  // Above the dots, which may be many.
  for (std::size_t camera : {std::size_t{0}, std::size_t{1}}) {
    if (rows[camera] != nullptr && rows[camera]->curve.at)
      plot.curves.push_back(curveThrough(*rows[camera], camera, words.log_x));
  }
  if (rows[0] != nullptr && rows[1] != nullptr) plot.below = panelBelow(*rows[0], *rows[1], words);
  return Figure{words.caption, toSvg(plot)};
}

}  // namespace toftwin::compare
