// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/residual.h"

#include <algorithm>
#include <cmath>

#include <toftwin/nan.h>

#include "calib/compare/statistics.h"

namespace toftwin::compare {
namespace {

constexpr std::size_t kFewestRows = 8;     ///< whose neighbours tell noise to about a third
constexpr std::size_t kRowsOfAGroup = 16;  ///< at least, where there are several
constexpr std::size_t kMostGroups = 8;

struct Rows {
  std::vector<double> x{}, y{};
};

/// Rows that can be drawn, in the order of x.
Rows ascending(std::span<const double> x, std::span<const double> y, Rest rule) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < std::min(x.size(), y.size()); ++i) {
    const bool has_logarithm = rule == Rest::Difference || y[i] > 0.0;
    if (std::isfinite(x[i]) && std::isfinite(y[i]) && has_logarithm) order.push_back(i);
  }
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return x[i]; });
  Rows rows;
  for (const std::size_t i : order) rows.x.push_back(x[i]), rows.y.push_back(y[i]);
  return rows;
}

/// σ of the rows from `first` up to `last`.
double noiseOf(const Rows& rows, std::size_t first, std::size_t last) {
  double squares = 0.0;
  for (std::size_t i = first + 1; i < last; ++i) squares += std::pow(rows.y[i] - rows.y[i - 1], 2);
  return std::sqrt(squares / (2.0 * static_cast<double>(last - first - 1)));
}

/// A group's σ stands at its middle; the outermost reach to the ends.
Curve bandOf(const Rows& rows, Rest rule) {
  Curve band{.name = "what neighbours differ by, ±1.96 σ", .ink = Ink::Baseline};
  const std::size_t n = rows.x.size(), groups = std::clamp<std::size_t>(n / kRowsOfAGroup, 1, kMostGroups);
  const auto add = [&](double x, double half) {
    band.x.push_back(x);
    band.low.push_back(rule == Rest::Ratio ? std::exp(-half) : -half);
    band.high.push_back(rule == Rest::Ratio ? std::exp(half) : half);
  };
  for (std::size_t g = 0; g < groups; ++g) {
    const std::size_t first = g * n / groups, last = (g + 1) * n / groups;
    const double half = 1.96 * noiseOf(rows, first, last);
    if (g == 0) add(rows.x.front(), half);
    if (groups > 1) add(0.5 * (rows.x[first] + rows.x[last - 1]), half);
    if (g + 1 == groups) add(rows.x.back(), half);
  }
  return band;
}

}  // namespace

Panel restPanel(std::string y_label, std::span<const double> x, std::span<const double> rest, Rest rule) {
  Panel panel{
      .y_label = std::move(y_label), .log_y = rule == Rest::Ratio, .zero = rule == Rest::Ratio ? 1.0 : 0.0};
  Rows rows = ascending(x, rest, rule);
  Curve dots{.x = rows.x, .y = rows.y, .ink = Ink::Extra, .stroke = Stroke::Dots};
  dots.name = panel.y_label.substr(0, panel.y_label.find(" ["));
  if (rule == Rest::Ratio) {
    for (double& one : rows.y) one = std::log(one);
  }
  if (rows.x.size() >= kFewestRows) panel.curves.push_back(bandOf(rows, rule));
  panel.curves.push_back(std::move(dots));
  return panel;
}

Panel measuredLess(std::span<const double> x, std::span<const double> measured,
                   std::span<const double> simulated, Rest rule) {
  std::vector<double> rest;
  for (std::size_t i = 0; i < std::min(measured.size(), simulated.size()); ++i)
    rest.push_back(rule == Rest::Ratio ? measured[i] / simulated[i] : measured[i] - simulated[i]);
  if (rule == Rest::Ratio) return restPanel("measured / simulated", x, rest, rule);
  Panel panel = restPanel("measured − simulated [mm]", x, rest, rule);
  const double reach = 1.2 * std::max(std::abs(quantile(rest, 0.01)), std::abs(quantile(rest, 0.99)));
  if (reach > 0.0) panel.y_range = std::pair{-reach, reach};
  return panel;
}

}  // namespace toftwin::compare
