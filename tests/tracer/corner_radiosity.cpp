// SPDX-License-Identifier: Apache-2.0
#include "tests/tracer/corner_radiosity.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace toftwin::sim::testing {
namespace {

/// Beyond this t the integrand has fallen to cosh⁻³ 6 = 1.2e-7 of its peak.
constexpr double kFarthest = 6.0;
constexpr double kScale_m = 0.5;  ///< of z

/// Gauss–Legendre nodes and weights on [−1, 1], by Newton's method on the polynomial.
struct Gauss {
  std::vector<double> x, w;
  explicit Gauss(int n) {
    for (int i = 0; i < n; ++i) {
      double at = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 1.0;
      for (int step = 0; step < 100; ++step) {
        double before = 1.0, value = at;
        for (int m = 2; m <= n; ++m) {
          const double next = ((2 * m - 1) * at * value - (m - 1) * before) / m;
          before = value;
          value = next;
        }
        slope = n * (at * value - before) / (at * at - 1.0);
        at -= value / slope;
        if (std::abs(value / slope) < 1e-15) break;
      }
      x.push_back(at);
      w.push_back(2.0 / ((1.0 - at * at) * slope * slope));
    }
  }
};

}  // namespace

CornerRadiosity::CornerRadiosity(double wavenumber, double distance, Walls walls, Grid grid)
    : k_(wavenumber),
      side_(distance / std::sqrt(2.0)),
      walls_(walls),
      grid_(grid),
      distinct_(static_cast<std::size_t>(grid.across / 2 + 1)) {
  const double from = std::log(walls.nearest), to = std::log(walls.length), most = std::asinh(walls.half_height / kScale_m);
  for (int i = 0; i < grid.along; ++i) log_x_.push_back(from + (to - from) * i / (grid.along - 1));
  for (int j = 0; j < grid.across; ++j) {
    turns_.push_back(most * std::cos(std::numbers::pi * j / (grid.across - 1)));
    const bool is_end = j == 0 || j == grid.across - 1;
    turn_weights_.push_back((j % 2 == 0 ? 1.0 : -1.0) * (is_end ? 0.5 : 1.0));
  }
  for (const double log_x : log_x_) {
    for (std::size_t j = 0; j < distinct_; ++j) {
      const double x = std::exp(log_x), z = kScale_m * std::sinh(turns_[j]);
      matrix_.push_back(row(x, z));
    }
  }
}

/// Irradiance phasor of wall A.
CornerRadiosity::Complex CornerRadiosity::direct(double x, double z) const {
  const double r = std::hypot(x - side_, side_, z);
  return side_ / (r * r * r) * std::polar(1.0, -k_ * r);
}

CornerRadiosity::Weights CornerRadiosity::weightsAt(double log_x, double z) const {
  Weights weights;
  const double step = log_x_[1] - log_x_[0], at = (log_x - log_x_.front()) / step;
  const double first = std::clamp(std::floor(at) - 1.0, 0.0, static_cast<double>(grid_.along - 4));
  weights.first_along = static_cast<std::size_t>(first);
  for (int i = 0; i < 4; ++i) {  // Lagrange
    weights.along[i] = 1.0;
    for (int m = 0; m < 4; ++m) {
      if (m != i) weights.along[i] *= (at - first - m) / (i - m);
    }
  }
  // Barycentric formula of the Chebyshev nodes
  const double turn = std::asinh(z / kScale_m);
  double sum = 0.0;
  weights.across.assign(distinct_, 0.0);
  for (std::size_t j = 0; j < turns_.size(); ++j) {
    const std::size_t node = std::min(j, turns_.size() - 1 - j);
    const double away = turn - turns_[j];
    if (std::abs(away) < 1e-14) {
      weights.across.assign(distinct_, 0.0);
      weights.across[node] = 1.0;
      return weights;
    }
    weights.across[node] += turn_weights_[j] / away;
    sum += turn_weights_[j] / away;
  }
  for (double& weight : weights.across) weight /= sum;
  return weights;
}

std::vector<CornerRadiosity::Complex> CornerRadiosity::row(double x, double z) const {
  static const Gauss panel{3};
  const Gauss angles{grid_.angles};
  std::vector<Complex> row(log_x_.size() * distinct_);
  const double step = log_x_[1] - log_x_[0];
  for (std::size_t i = 0; i + 1 < log_x_.size(); ++i) {
    for (std::size_t g = 0; g < panel.x.size(); ++g) {
      const double log_y = log_x_[i] + step * (panel.x[g] + 1.0) / 2.0, y = std::exp(log_y);
      const double q = std::hypot(x, y);
      const double low = std::max(-kFarthest, std::asinh((-walls_.half_height - z) / q));
      const double high = std::min(kFarthest, std::asinh((walls_.half_height - z) / q));
      for (std::size_t a = 0; a < angles.x.size(); ++a) {
        const double t = (low + high + (high - low) * angles.x[a]) / 2.0;
        const double d = q * std::cosh(t);
        const double measure = panel.w[g] * step / 2.0 * y * angles.w[a] * (high - low) / 2.0 * d;
        const double there = z + q * std::sinh(t);
        const Complex share = x * y / (std::numbers::pi * d * d * d * d) * measure * std::polar(1.0, -k_ * d) *
                              direct(y, there) / direct(x, z);
        const Weights weights = weightsAt(log_y, there);
        for (std::size_t n = 0; n < 4; ++n) {
          const std::size_t start = (weights.first_along + n) * distinct_;
          for (std::size_t j = 0; j < distinct_; ++j) row[start + j] += share * weights.along[n] * weights.across[j];
        }
      }
    }
  }
  return row;
}

std::vector<CornerRadiosity::Complex> CornerRadiosity::solve(double albedo, int bounces) const {
  // Each bounce carries at most ρ/2 of the light before it: the form factor of a wall of this corner.
  std::vector<Complex> ratio(matrix_.size(), 1.0), next(matrix_.size());
  double change = 1.0;
  for (int bounce = 0; bounce < bounces && change > 1e-10; ++bounce) {
    change = 0.0;
    for (std::size_t i = 0; i < ratio.size(); ++i) {
      Complex sum;
      for (std::size_t j = 0; j < ratio.size(); ++j) sum += matrix_[i][j] * ratio[j];
      next[i] = 1.0 + albedo * sum;
      change = std::max(change, std::abs(next[i] - ratio[i]));
    }
    std::swap(ratio, next);
  }
  return ratio;
}

double CornerRadiosity::error(double albedo, double u, int surfaces) const {
  const std::vector<Complex> ratio = solve(albedo, surfaces - 2), weights = row(u, 0.0);
  Complex at_place = 1.0;  // beside the direct light
  for (std::size_t j = 0; j < weights.size(); ++j) at_place += albedo * weights[j] * ratio[j];
  return -std::arg(at_place) / (2.0 * k_);
}

}  // namespace toftwin::sim::testing
