// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/own_series.h"

#include <algorithm>
#include <cmath>

#include "calib/compare/statistics.h"

namespace toftwin::plan {
namespace {

/// Captures that have at least this share of the most pixels that any has. Less light or a strong one leaves
/// few: these would be all that the others are judged by.
constexpr double kFewest = 0.5;

std::size_t validOf(const Image<float>& range) {
  std::size_t valid = 0;
  for (std::size_t i = 0; i < range.size(); ++i) valid += std::isfinite(range[i]) ? 1 : 0;
  return valid;
}

/// Pixels that all captures have.
std::vector<std::size_t> pixelsOfAll(const std::vector<const ComparedCapture*>& captures,
                                     std::size_t camera) {
  std::vector<std::size_t> pixels;
  std::vector<double> ranges(captures.size());
  for (std::size_t i = 0; i < captures.front()->own[camera].range_mm.size(); ++i) {
    std::ranges::transform(captures, ranges.begin(), [&](const ComparedCapture* one) {
      return static_cast<double>(one->own[camera].range_mm[i]);
    });
    if (!std::ranges::all_of(ranges, [](double one) { return std::isfinite(one); })) continue;
    const double middle = compare::quantile(ranges, 0.5);
    if (std::ranges::none_of(ranges, [&](double one) { return compare::isGross(one - middle); }))
      pixels.push_back(i);
  }
  return pixels;
}

}  // namespace

OwnSeries ownSeries(const ComparedRun& run, std::string_view kind, std::size_t camera) {
  std::vector<const ComparedCapture*> all;
  std::size_t most = 0, size = 0;
  for (const ComparedCapture& one : run.captures) {
    const Image<float>& range = one.own[camera].range_mm;
    if (one.record.kind != kind || range.empty() || (size != 0 && range.size() != size)) continue;
    all.push_back(&one), size = range.size(), most = std::max(most, validOf(range));
  }
  OwnSeries series;
  for (const ComparedCapture* one : all) {
    if (static_cast<double>(validOf(one->own[camera].range_mm)) >= kFewest * static_cast<double>(most))
      series.captures.push_back(one);
    else
      series.left_out.push_back(one);
  }
  if (series.captures.empty() || most == 0) return {};
  const auto pixels = pixelsOfAll(series.captures, camera);
  if (pixels.empty()) return {};
  series.pixels = pixels.size();
  for (const ComparedCapture* one : series.captures) {
    const auto& [range, noise, own_noise, amplitude] = one->own[camera];
    const Image<float>& first = series.captures.front()->own[camera].range_mm;
    compare::Running moved;
    std::vector<double> noises;
    for (const std::size_t i : pixels) {
      moved.add(static_cast<double>(range[i]) - static_cast<double>(first[i]));
      if (!noise.empty() && std::isfinite(noise[i])) noises.push_back(static_cast<double>(noise[i]));
    }
    series.range_mm.push_back(moved.mean()),
        series.noise_mm.push_back(compare::quantile(std::move(noises), 0.5));
  }
  return series;
}

}  // namespace toftwin::plan
