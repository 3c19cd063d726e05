// SPDX-License-Identifier: Apache-2.0
#include "drivers/ray_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace toftwin::drivers {
namespace {

// fx fy cx cy k1 k2 p1 p2 k3
constexpr std::size_t kUnknowns = 9;
using Vector = std::array<double, kUnknowns>;
using Matrix = std::array<Vector, kUnknowns>;
constexpr int kRounds = 20;
constexpr std::size_t kFewest = 64;
constexpr double kMost = 4000.0;  // rays, evenly over the image: more tell nothing new

struct Observation {
  double x, y, u, v;
};

/// Solves A s = b for a symmetric, positive definite A by Cholesky. False if it is not.
bool solve(Matrix& a, Vector& b) {
  for (std::size_t j = 0; j < kUnknowns; ++j) {
    for (std::size_t k = 0; k < j; ++k) a[j][j] -= a[j][k] * a[j][k];
    if (!(a[j][j] > 0.0)) return false;
    a[j][j] = std::sqrt(a[j][j]);
    for (std::size_t i = j + 1; i < kUnknowns; ++i) {
      for (std::size_t k = 0; k < j; ++k) a[i][j] -= a[i][k] * a[j][k];
      a[i][j] /= a[j][j];
    }
  }
  for (std::size_t i = 0; i < kUnknowns; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
  }
  for (std::size_t i = kUnknowns; i-- > 0;) {
    for (std::size_t k = i + 1; k < kUnknowns; ++k) b[i] -= a[k][i] * b[k];
    b[i] /= a[i][i];
  }
  return true;
}

struct Linearised {
  Vector du{}, dv{};  // derivatives of u and v
  double u = 0.0, v = 0.0;
};
Linearised project(const Vector& p, double x, double y) {
  const auto& [fx, fy, cx, cy, k1, k2, p1, p2, k3] = p;
  const double r2 = x * x + y * y, r4 = r2 * r2, r6 = r4 * r2;
  const double radial = 1.0 + k1 * r2 + k2 * r4 + k3 * r6;
  const double xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
  const double yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
  const double xy = 2.0 * x * y;
  return {
      .du = {xd, 0, 1, 0, fx * x * r2, fx * x * r4, fx * xy, fx * (r2 + 2 * x * x), fx * x * r6},
      .dv = {0, yd, 0, 1, fy * y * r2, fy * y * r4, fy * (r2 + 2 * y * y), fy * xy, fy * y * r6},
      .u = fx * xd + cx,
      .v = fy * yd + cy};
}

std::vector<Observation> observationsOf(int width, int height, std::span<const float> rays) {
  std::vector<Observation> seen;
  const int step = std::max(1, static_cast<int>(std::sqrt(width * height / kMost)));
  for (int v = 0; v < height; v += step) {
    for (int u = 0; u < width; u += step) {
      const auto at = 3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                           static_cast<std::size_t>(u));
      const double x = rays[at], y = rays[at + 1], z = rays[at + 2];
      if (!(z > 0.0) || !std::isfinite(x) || !std::isfinite(y)) continue;
      seen.push_back({x / z, y / z, static_cast<double>(u), static_cast<double>(v)});
    }
  }
  return seen;
}

/// Without distortion, from the outermost rays.
Vector firstGuess(int width, int height, const std::vector<Observation>& seen) {
  const auto [left, right] = std::ranges::minmax_element(seen, {}, &Observation::x);
  const auto [top, bottom] = std::ranges::minmax_element(seen, {}, &Observation::y);
  const double fx = (width - 1) / (right->x - left->x), fy = (height - 1) / (bottom->y - top->y);
  return {fx, fy, -fx * left->x, -fy * top->y, 0, 0, 0, 0, 0};
}

struct Round {
  Vector improved{};
  double sum_of_squares = 0.0;
  bool is_solvable = false;
};
Round improve(const Vector& p, const std::vector<Observation>& seen) {
  Matrix normal{};
  Vector right{};
  Round round{.improved = p};
  for (const Observation& one : seen) {
    const Linearised at = project(p, one.x, one.y);
    const double eu = one.u - at.u, ev = one.v - at.v;
    round.sum_of_squares += eu * eu + ev * ev;
    for (std::size_t i = 0; i < kUnknowns; ++i) {
      right[i] += at.du[i] * eu + at.dv[i] * ev;
      for (std::size_t k = 0; k <= i; ++k)
        normal[i][k] += at.du[i] * at.du[k] + at.dv[i] * at.dv[k];
    }
  }
  round.is_solvable = solve(normal, right);
  for (std::size_t i = 0; i < kUnknowns; ++i) round.improved[i] += right[i];
  return round;
}

}  // namespace

Result<FittedCamera> fitCamera(int width, int height, std::span<const float> rays) {
  const Error no_camera{
      Error::Code::InvalidArgument,
      fmt::format("the rays of the {} x {} pixels are not those of a camera", width, height)};
  if (width < 2 || height < 2 ||
      rays.size() < 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    return no_camera;
  }
  const auto seen = observationsOf(width, height, rays);
  if (seen.size() < kFewest) return no_camera;
  Vector p = firstGuess(width, height, seen);
  double last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kRounds; ++i) {
    const Round round = improve(p, seen);
    if (!round.is_solvable || !std::isfinite(round.improved[0])) return no_camera;
    p = round.improved;
    // Quadratic convergence: when a round gains nothing any more, the one before was the last.
    if (i > 2 && !(round.sum_of_squares < 0.999 * last)) break;
    last = round.sum_of_squares;
  }
  const double rms_px =
      std::sqrt(improve(p, seen).sum_of_squares / (2.0 * static_cast<double>(seen.size())));
  if (!std::isfinite(rms_px) || !(p[0] > 0.0) || !(p[1] > 0.0)) return no_camera;
  return FittedCamera{{.width = width,
                       .height = height,
                       .fx = p[0],
                       .fy = p[1],
                       .cx = p[2],
                       .cy = p[3],
                       .distortion = {p[4], p[5], p[6], p[7], p[8]},
                       .calibration_id = {}},
                      rms_px};
}

}  // namespace toftwin::drivers
