// SPDX-License-Identifier: Apache-2.0
#include "calib/table/line_fit.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace toftwin::table {
namespace {

double quantileOf(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}
double medianOf(std::vector<double> values) { return quantileOf(std::move(values), 0.5); }

double medianDistance(std::vector<double> values) {
  const double middle = medianOf(values);
  for (double& v : values) v = std::abs(v - middle);
  return medianOf(std::move(values));
}

/// Ranks, the mean of them for equal values, less their mean.
std::vector<double> ranksOf(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return values[i]; });
  std::vector<double> ranks(values.size());
  const double mean = 0.5 * static_cast<double>(values.size() - 1);
  for (std::size_t i = 0; i < order.size();) {
    std::size_t end = i;
    while (end < order.size() && values[order[end]] == values[order[i]]) ++end;
    for (std::size_t k = i; k < end; ++k) ranks[order[k]] = 0.5 * static_cast<double>(i + end - 1) - mean;
    i = end;
  }
  return ranks;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const double ab = std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
  const double aa = std::inner_product(a.begin(), a.end(), a.begin(), 0.0);
  const double bb = std::inner_product(b.begin(), b.end(), b.begin(), 0.0);
  return aa > 0.0 && bb > 0.0 ? ab / std::sqrt(aa * bb) : 0.0;
}

/// Siegel, Biometrika 69 (1982): the median over all points of the median slope to the others. Half of them
/// may be odd.
double repeatedMedian(const std::vector<double>& x, const std::vector<double>& y) {
  std::vector<double> of_points, slopes;
  for (std::size_t i = 0; i < x.size(); ++i) {
    slopes.clear();
    for (std::size_t k = 0; k < x.size(); ++k)
      if (x[k] != x[i]) slopes.push_back((y[k] - y[i]) / (x[k] - x[i]));
    if (!slopes.empty()) of_points.push_back(medianOf(slopes));
  }
  return medianOf(std::move(of_points));
}

}  // namespace

LineFit lineThrough(const std::vector<double>& x, const std::vector<double>& y) {
  constexpr std::size_t kMost = 400;
  std::vector<double> a, b;
  for (std::size_t i = 0; i < std::min(x.size(), y.size()); ++i)  // texts have no values
    if (std::isfinite(x[i]) && std::isfinite(y[i])) a.push_back(x[i]), b.push_back(y[i]);
  LineFit fit{.pairs = a.size()};
  if (a.size() < 3) return fit;
  const std::size_t rows = std::min(a.size(), kMost), all = a.size();
  for (std::size_t i = 0; i < rows; ++i) a[i] = a[i * all / rows], b[i] = b[i * all / rows];
  a.resize(rows), b.resize(rows);
  fit.spread_x = quantileOf(a, 0.9) - quantileOf(a, 0.1),
  fit.spread_y = quantileOf(b, 0.9) - quantileOf(b, 0.1);
  fit.rank = correlation(ranksOf(a), ranksOf(b));
  fit.slope = repeatedMedian(a, b);
  std::vector<double> left(rows);
  for (std::size_t i = 0; i < rows; ++i) left[i] = b[i] - fit.slope * a[i];
  const double whole = medianDistance(b);
  if (whole > 0.0) fit.beside = medianDistance(std::move(left)) / whole;
  return fit;
}

}  // namespace toftwin::table
