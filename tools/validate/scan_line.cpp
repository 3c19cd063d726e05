// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/scan_line.h"

#include <algorithm>
#include <cmath>

#include <toftwin/nan.h>

namespace toftwin::validate {

double ScanLine::z_mm(std::size_t i) const { return range_mm[i] / std::sqrt(1.0 + t[i] * t[i]); }
double ScanLine::x_mm(std::size_t i) const { return t[i] * z_mm(i); }

ScanLine toScanLine(std::span<const double> x_mm, std::span<const double> z_mm) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < x_mm.size(); ++i) {
    if (std::isfinite(x_mm[i]) && std::isfinite(z_mm[i]) && z_mm[i] > 0.0) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return x_mm[a] / z_mm[a] < x_mm[b] / z_mm[b];
  });
  ScanLine line;
  for (const std::size_t i : order) {
    line.t.push_back(x_mm[i] / z_mm[i]);
    line.range_mm.push_back(std::hypot(x_mm[i], z_mm[i]));
  }
  return line;
}

double rangeAlong(const ScanLine& line, double t, double max_gap) {
  const auto above = std::lower_bound(line.t.begin(), line.t.end(), t);
  if (above == line.t.end()) return kNaN;
  const auto i = static_cast<std::size_t>(above - line.t.begin());
  if (line.t[i] == t) return line.range_mm[i];
  if (i == 0 || line.t[i] - line.t[i - 1] > max_gap) return kNaN;
  const double share = (t - line.t[i - 1]) / (line.t[i] - line.t[i - 1]);
  const double z = line.z_mm(i - 1) + share * (line.z_mm(i) - line.z_mm(i - 1));
  return z * std::sqrt(1.0 + t * t);
}

std::vector<double> rangesAlong(const ScanLine& line, std::span<const double> t, double max_gap) {
  std::vector<double> ranges;
  for (const double direction : t) ranges.push_back(rangeAlong(line, direction, max_gap));
  return ranges;
}

double placeOf(std::span<const EdgePoint> edges, double t, double range_mm) {
  if (edges.empty()) return kNaN;
  const double z = range_mm / std::sqrt(1.0 + t * t);
  const auto from = [&](const EdgePoint& edge) { return std::hypot(t * z - edge.x_mm, z - edge.z_mm); };
  const EdgePoint &left = edges.front(), &right = edges.back();
  if (t < left.x_mm / left.z_mm) return -from(left);
  if (edges.size() > 1 && t <= right.x_mm / right.z_mm) return 0.0;
  return from(right);
}

}  // namespace toftwin::validate
