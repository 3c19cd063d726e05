// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::compare {

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
Result<ScanLine> loadScanLine(const std::filesystem::path& file);

/// The range along direction t, linear in z between the two neighbouring rays. NaN outside the line
/// and in gaps wider than `max_gap` (in t), where there is no measurement to interpolate.
double rangeAlong(const ScanLine& line, double t, double max_gap = 0.02);
/// The same for many directions.
std::vector<double> rangesAlong(const ScanLine& line, std::span<const double> t,
                                double max_gap = 0.02);

/// A straight line in the scan plane: normal · (x, z) = distance_mm, normal of unit length pointing
/// away from the camera (distance > 0).
struct PlanarLine {
  double normal_x = 0.0, normal_z = 1.0;
  double distance_mm = 0.0;
  double rms_mm = 0.0;  ///< orthogonal residual of the points it was fitted to
  std::size_t n = 0;
  /// Where the ray t meets it; NaN if it doesn't.
  [[nodiscard]] double rangeAlong(double t) const;
};
/// Total least squares: minimises orthogonal distances. It starts from the least median of squares
/// and leaves points out that are farther than `trim` times 1.4826 median distances, so that a box
/// before the wall does not tilt it.
PlanarLine fitPlanarLine(std::span<const double> x_mm, std::span<const double> z_mm,
                         double trim = 3.5);

/// Two planes that meet in a vertical edge, seen in section.
struct CornerFit {
  PlanarLine left, right;
  double edge_x_mm = 0.0, edge_z_mm = 0.0;
  double opening_deg = 0.0;     ///< between the walls, inside
  double left_length_mm = 0.0;  ///< from the edge to the line's outermost point
  double right_length_mm = 0.0;
  [[nodiscard]] double edge_t() const { return edge_x_mm / edge_z_mm; }
  /// Range to the nearer wall that faces the ray: the noise-free prediction without simulation.
  [[nodiscard]] double rangeAlong(double t) const;
};
/// Error where the points do not show two walls of at least ten points that meet in front of the
/// camera.
Result<CornerFit> fitCorner(const ScanLine& line);

}  // namespace toftwin::compare
