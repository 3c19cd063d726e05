// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/scan_line.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/compare/statistics.h"
#include "calib/table/table.h"

namespace toftwin::compare {
namespace {

/// Orthogonal regression in two dimensions: the direction of largest variance is the line's.
PlanarLine totalLeastSquares(const std::vector<double>& x, const std::vector<double>& z) {
  Running mean_x, mean_z;
  for (std::size_t i = 0; i < x.size(); ++i) mean_x.add(x[i]), mean_z.add(z[i]);
  double sxx = 0.0, szz = 0.0, sxz = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double dx = x[i] - mean_x.mean(), dz = z[i] - mean_z.mean();
    sxx += dx * dx, szz += dz * dz, sxz += dx * dz;
  }
  const double along = 0.5 * std::atan2(2.0 * sxz, sxx - szz);
  PlanarLine line{.normal_x = -std::sin(along), .normal_z = std::cos(along)};
  line.distance_mm = line.normal_x * mean_x.mean() + line.normal_z * mean_z.mean();
  if (line.distance_mm < 0.0) {
    line.normal_x = -line.normal_x, line.normal_z = -line.normal_z,
    line.distance_mm = -line.distance_mm;
  }
  double squares = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    squares += std::pow(line.normal_x * x[i] + line.normal_z * z[i] - line.distance_mm, 2);
  }
  line.n = x.size();
  line.rms_mm = std::sqrt(squares / static_cast<double>(x.size()));
  return line;
}

std::vector<double> distancesTo(const PlanarLine& line, const std::vector<double>& x,
                                const std::vector<double>& z) {
  std::vector<double> distance;
  for (std::size_t i = 0; i < x.size(); ++i) {
    distance.push_back(std::abs(line.normal_x * x[i] + line.normal_z * z[i] - line.distance_mm));
  }
  return distance;
}

/// Least median of squares over lines through pairs of points (Rousseeuw 1984): up to half of the
/// points may lie elsewhere. The pairs are a fixed spread of near and far ones, so it is
/// deterministic.
PlanarLine leastMedian(const std::vector<double>& x, const std::vector<double>& z) {
  PlanarLine best = totalLeastSquares(x, z);
  double least = quantile(distancesTo(best, x, z), 0.5);
  const std::size_t n = x.size();
  constexpr std::size_t kStarts = 24;
  for (std::size_t i = 0; i < kStarts; ++i) {
    for (std::size_t j = i + 1; j < kStarts; ++j) {
      const std::size_t a = i * (n - 1) / (kStarts - 1), b = j * (n - 1) / (kStarts - 1);
      if (a == b) continue;
      const PlanarLine line = totalLeastSquares({x[a], x[b]}, {z[a], z[b]});
      const double median = quantile(distancesTo(line, x, z), 0.5);
      if (median < least) least = median, best = line;
    }
  }
  return best;
}

struct Points {
  std::vector<double> x, z;
};
Points pointsOf(const ScanLine& line, std::size_t from, std::size_t to) {
  Points points;
  for (std::size_t i = from; i < to; ++i)
    points.x.push_back(line.x_mm(i)), points.z.push_back(line.z_mm(i));
  return points;
}

/// The split that two straight lines fit best, leaving a few pixels around the edge out of both.
std::size_t bestSplit(const ScanLine& line, std::size_t margin) {
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t split = margin + 10; split + margin + 10 < line.size(); ++split) {
    const Points a = pointsOf(line, 0, split - margin),
                 b = pointsOf(line, split + margin, line.size());
    const PlanarLine left = totalLeastSquares(a.x, a.z), right = totalLeastSquares(b.x, b.z);
    const double cost = left.rms_mm * left.rms_mm * static_cast<double>(left.n) +
                        right.rms_mm * right.rms_mm * static_cast<double>(right.n);
    if (cost < least) least = cost, best = split;
  }
  return best;
}

}  // namespace

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

Result<ScanLine> loadScanLine(const std::filesystem::path& file) {
  auto columns = table::readNumbers(file, {"x_mm", "z_mm"});
  if (!columns) return columns.error();
  return toScanLine((*columns)[0], (*columns)[1]);
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

double PlanarLine::rangeAlong(double t) const {
  // (x, z) = z (t, 1)  =>  z = distance / (normal_x t + normal_z)
  const double facing = normal_x * t + normal_z;
  return facing > 1e-9 ? distance_mm / facing * std::sqrt(1.0 + t * t) : kNaN;
}

PlanarLine fitPlanarLine(std::span<const double> x_mm, std::span<const double> z_mm, double trim) {
  const std::vector<double> all_x(x_mm.begin(), x_mm.end()), all_z(z_mm.begin(), z_mm.end());
  std::vector<double> x = all_x, z = all_z;
  PlanarLine line = leastMedian(x, z);
  for (int round = 0; round < 10; ++round) {
    const std::vector<double> distance = distancesTo(line, all_x, all_z);
    // Half a millimetre is what the files are rounded to: never trim below it.
    const double limit = std::max(0.5, trim * 1.4826 * quantile(distance, 0.5));
    std::vector<double> kept_x, kept_z;
    for (std::size_t i = 0; i < all_x.size(); ++i) {
      if (distance[i] <= limit) kept_x.push_back(all_x[i]), kept_z.push_back(all_z[i]);
    }
    if (kept_x.size() < 10 || (round > 0 && kept_x == x)) break;
    x = std::move(kept_x), z = std::move(kept_z);
    line = totalLeastSquares(x, z);
  }
  return line;
}

double CornerFit::rangeAlong(double t) const {
  // Seen from inside the corner, the wall on the ray's side of the edge is the one that it meets.
  return t < edge_t() ? left.rangeAlong(t) : right.rangeAlong(t);
}

Result<CornerFit> fitCorner(const ScanLine& line) {
  constexpr std::size_t kMargin = 5;  // pixels beside the edge that a real line rounds off
  const std::size_t split = line.size() > 2 * (kMargin + 10) ? bestSplit(line, kMargin) : 0;
  const Error not_a_corner{
      Error::Code::InvalidArgument,
      fmt::format("the scan line of {} points does not show a corner: two walls "
                  "of at least ten points that meet in front of the camera",
                  line.size())};
  if (split == 0) return not_a_corner;
  const Points a = pointsOf(line, 0, split - kMargin),
               b = pointsOf(line, split + kMargin, line.size());
  CornerFit fit{.left = fitPlanarLine(a.x, a.z), .right = fitPlanarLine(b.x, b.z)};
  const double determinant =
      fit.left.normal_x * fit.right.normal_z - fit.left.normal_z * fit.right.normal_x;
  if (std::abs(determinant) < 0.1) return not_a_corner;
  fit.edge_x_mm =
      (fit.left.distance_mm * fit.right.normal_z - fit.right.distance_mm * fit.left.normal_z) /
      determinant;
  fit.edge_z_mm =
      (fit.right.distance_mm * fit.left.normal_x - fit.left.distance_mm * fit.right.normal_x) /
      determinant;
  if (fit.edge_z_mm <= 0.0) return not_a_corner;
  const double between =
      std::acos(fit.left.normal_x * fit.right.normal_x + fit.left.normal_z * fit.right.normal_z);
  fit.opening_deg = 180.0 - between * 180.0 / std::numbers::pi;
  fit.left_length_mm = std::hypot(a.x.front() - fit.edge_x_mm, a.z.front() - fit.edge_z_mm);
  fit.right_length_mm = std::hypot(b.x.back() - fit.edge_x_mm, b.z.back() - fit.edge_z_mm);
  return fit;
}

}  // namespace toftwin::compare
