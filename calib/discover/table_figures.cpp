// SPDX-License-Identifier: Apache-2.0
// An effect of a table as the page shows it: over each of its covariates.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "calib/discover/curve.h"
#include "calib/discover/discover_table.h"

namespace toftwin::discover {
namespace {

using compare::Curve, compare::FigureRow, compare::Ink, compare::Plot, compare::Stroke;

/// One picture: a covariate along the abscissa, and which rows are shown.
struct View {
  const TableCovariate& along;
  std::map<std::string, double> at{};  ///< the other covariates
  std::vector<bool> shown{};
  std::string of{};  ///< what is the same in all of these rows; empty: nothing
};

std::vector<double> those(const std::vector<double>& values, const std::vector<bool>& shown) {
  std::vector<double> out;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (shown[i]) out.push_back(values[i]);
  return out;
}

/// The effect over one covariate, with 95 % about it.
Curve curveOf(const Effect& effect, const View& view, const Level& level) {
  Curve curve{.name = view.of.empty() ? effect.name : effect.name + ", " + view.of, .ink = Ink::Simulated};
  const auto x = those(view.along.values, view.shown);
  if (x.empty()) return curve;
  const auto [low, high] = std::ranges::minmax(x);
  auto at = view.at;
  for (int i = 0; i <= 300; ++i) {
    at[view.along.name] = low + (high - low) * i / 300.0;
    const Point point = effectAt(effect, at, level);
    curve.x.push_back(at[view.along.name]), curve.y.push_back(point.value);
    curve.low.push_back(point.value - 1.96 * point.error),
        curve.high.push_back(point.value + 1.96 * point.error);
  }
  return curve;
}

/// Whether each of its values deserves a picture of its own.
bool isOneOfFew(const TableDiscovery& d, const std::string& name) {
  const auto info = std::ranges::find(d.infos, name, &CovariateInfo::name);
  return info != d.infos.end() && (info->nature == Nature::Category || info->levels.size() == 2);
}

/// A view for each value, if one of an effect's two covariates has few: what crosses in them is nothing on
/// average.
std::vector<View> viewsOf(const TableDiscovery& d, const Effect& effect, const TableCovariate& along) {
  std::vector<View> views;
  for (const std::string& name : effect.covariates) {
    if (effect.covariates.size() != 2 || name == along.name || !isOneOfFew(d, name)) continue;
    const auto other = std::ranges::find(d.open.covariates, name, &TableCovariate::name);
    const auto info = std::ranges::find(d.infos, name, &CovariateInfo::name);
    for (const double level : info->levels) {
      const std::string value =
          other->words.empty() ? fmt::format("{:.4g}", level) : other->words[static_cast<std::size_t>(level)];
      View view{along, {{name, level}}, {}, fmt::format("{} = {}", name, value)};
      for (const double one : other->values) view.shown.push_back(one == level);
      views.push_back(std::move(view));
    }
  }
  if (views.empty()) views.push_back({along, {}, std::vector<bool>(d.open.rows(), true), {}});
  return views;
}

}  // namespace

Curve binned(const std::vector<double>& x, const std::vector<double>& y, std::string name, Ink ink) {
  std::vector<std::size_t> order(x.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order, {}, [&](std::size_t i) { return x[i]; });
  Curve curve{.name = std::move(name), .ink = ink, .stroke = Stroke::Dots};
  const std::size_t size = std::max<std::size_t>(1, (x.size() + 39) / 40);
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = std::min(begin + size, order.size());
    while (end < order.size() && x[order[end]] == x[order[end - 1]]) ++end;  // equal x stay together
    double mean_x = 0.0, mean_y = 0.0;
    for (std::size_t i = begin; i < end; ++i) mean_x += x[order[i]], mean_y += y[order[i]];
    curve.x.push_back(mean_x / static_cast<double>(end - begin)),
        curve.y.push_back(mean_y / static_cast<double>(end - begin));
    begin = end;
  }
  return curve;
}

FigureRow figuresOf(const TableDiscovery& d, const Effect& effect) {
  FigureRow row;
  const Level level = levelOf(effect, d.open);
  auto pure = effectIn(d.open, effect);
  for (double& value : pure) value -= level.value;
  auto own = pure;
  for (std::size_t i = 0; i < own.size(); ++i) own[i] += d.after[i];
  for (const std::string& name : effect.covariates) {
    const auto along = std::ranges::find(d.open.covariates, name, &TableCovariate::name);
    if (along == d.open.covariates.end()) continue;
    const auto few =
        std::ranges::count_if(effect.covariates, [&](const auto& one) { return isOneOfFew(d, one); });
    if (few == 1 && effect.covariates.size() == 2 && isOneOfFew(d, name))
      continue;  // pictures are over the other one
    for (const View& view : viewsOf(d, effect, *along)) {
      const bool is_exact = effect.covariates.size() == 1 || !view.of.empty();
      const auto x = those(along->values, view.shown);
      std::vector<Curve> curves{binned(x, those(own, view.shown), "rows, averaged in groups", Ink::Measured)};
      curves.push_back(is_exact ? curveOf(effect, view, level)
                                : binned(x, those(pure, view.shown), effect.name, Ink::Simulated));
      row.figures.push_back(
          {fmt::format(
               "{} over {}{}: measured − reference without nuisances and other effects, above its mean{}.",
               effect.name, name, view.of.empty() ? "" : ", " + view.of,
               is_exact ? "; band: 95 %" : "; averages of the same rows"),
           toSvg(Plot{.title = effect.name,
                      .x_label = name,
                      .y_label = d.open.unit.empty() ? "error" : fmt::format("error [{}]", d.open.unit),
                      .curves = std::move(curves),
                      .zero_line = true,
                      .compact = effect.covariates.size() > 1})});
    }
  }
  return row;
}

}  // namespace toftwin::discover
