// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace toftwin::validate {

/// One image row seen from above: per pixel the ray's direction t = x/z and the range along it, in
/// order of t. All rays lie in the plane y = 0, so range = z √(1 + t²).
struct ScanLine {
  std::vector<double> t;
  std::vector<double> range_mm;

  [[nodiscard]] std::size_t size() const { return t.size(); }
  [[nodiscard]] double x_mm(std::size_t i) const;
  [[nodiscard]] double z_mm(std::size_t i) const;
};

/// From points in the camera's frame; points with z ≤ 0 or not finite are left out, the rest
/// sorted.
ScanLine toScanLine(std::span<const double> x_mm, std::span<const double> z_mm);

/// The range along direction t, linear in z between the two neighbouring rays. NaN outside the line
/// and in gaps wider than `max_gap` (in t), where there is no measurement to interpolate.
double rangeAlong(const ScanLine& line, double t, double max_gap = 0.02);
/// The same for many directions.
std::vector<double> rangesAlong(const ScanLine& line, std::span<const double> t,
                                double max_gap = 0.02);

/// An edge that places on a line are told from, in the camera's frame.
struct EdgePoint {
  double x_mm = 0.0, z_mm = 0.0;
};
/// How far the point of a line along ray t at that range is from the nearest edge, in mm; negative to the left of it. With
/// two edges, what they hide is at 0. NaN without edges.
double placeOf(std::span<const EdgePoint> edges, double t, double range_mm);

}  // namespace toftwin::validate
