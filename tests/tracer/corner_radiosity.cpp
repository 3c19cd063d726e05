// SPDX-License-Identifier: Apache-2.0
#include "tests/tracer/corner_radiosity.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace toftwin::sim::testing {
namespace {

constexpr double kLength = 1.0, kHalfHeight = 0.5;
/// Light that starts nearer to the edge than this, 0.1 mm, is left out: it is less than the share
/// (0.1 mm / u)², 3e-5 at u = 2 cm.
constexpr double kNearest = 1e-4;
/// Beyond this t the integrand has fallen to cosh⁻³ 9 = 1.5e-11 of its peak.
constexpr double kFarthest = 9.0;

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

/// Irradiance phasor of wall A at (x, 0, z) from the isotropic light (1 W/sr) at (side, side, 0).
std::complex<double> direct(double x, double z, double side, double k) {
  const double r = std::hypot(x - side, side, z);
  return side / (r * r * r) * std::polar(1.0, -k * r);
}

}  // namespace

CornerRadiosity::CornerRadiosity(double wavenumber, Grid grid) : k_(wavenumber), grid_(grid) {
  const double from = std::log(kNearest), to = std::log(kLength);
  for (int i = 0; i < grid.along; ++i) log_x_.push_back(from + (to - from) * i / (grid.along - 1));
  for (int j = 0; j < grid.across; ++j) {
    z_.push_back(kHalfHeight * std::cos(std::numbers::pi * j / (grid.across - 1)));
    const bool is_end = j == 0 || j == grid.across - 1;
    z_weights_.push_back((j % 2 == 0 ? 1.0 : -1.0) * (is_end ? 0.5 : 1.0));
  }
  for (const double log_x : log_x_) {
    for (const double z : z_) matrix_.push_back(row(std::exp(log_x), z));
  }
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
  double sum = 0.0;
  for (std::size_t j = 0; j < z_.size(); ++j) {
    const double away = z - z_[j];
    if (std::abs(away) < 1e-14) {
      weights.across.assign(z_.size(), 0.0);
      weights.across[j] = 1.0;
      return weights;
    }
    weights.across.push_back(z_weights_[j] / away);
    sum += weights.across.back();
  }
  for (double& weight : weights.across) weight /= sum;
  return weights;
}

std::vector<CornerRadiosity::Complex> CornerRadiosity::row(double x, double z) const {
  static const Gauss panel{3};
  const Gauss angles{grid_.angles};
  std::vector<Complex> row(log_x_.size() * z_.size());
  const double step = log_x_[1] - log_x_[0];
  for (std::size_t i = 0; i + 1 < log_x_.size(); ++i) {
    for (std::size_t g = 0; g < panel.x.size(); ++g) {
      const double log_y = log_x_[i] + step * (panel.x[g] + 1.0) / 2.0, y = std::exp(log_y);
      const double q = std::hypot(x, y);
      const double low = std::max(-kFarthest, std::asinh((-kHalfHeight - z) / q));
      const double high = std::min(kFarthest, std::asinh((kHalfHeight - z) / q));
      for (std::size_t a = 0; a < angles.x.size(); ++a) {
        const double t = (low + high + (high - low) * angles.x[a]) / 2.0;
        const double d = q * std::cosh(t);
        const double measure = panel.w[g] * step / 2.0 * y * angles.w[a] * (high - low) / 2.0 * d;
        const Complex share = x * y / (std::numbers::pi * d * d * d * d) * measure * std::polar(1.0, -k_ * d);
        const Weights weights = weightsAt(log_y, z + q * std::sinh(t));
        for (std::size_t n = 0; n < 4; ++n) {
          const std::size_t start = (weights.first_along + n) * z_.size();
          for (std::size_t j = 0; j < z_.size(); ++j) row[start + j] += share * weights.along[n] * weights.across[j];
        }
      }
    }
  }
  return row;
}

std::vector<CornerRadiosity::Complex> CornerRadiosity::solve(double side, double albedo) const {
  std::vector<Complex> source;
  for (const double log_x : log_x_) {
    for (const double z : z_) source.push_back(direct(std::exp(log_x), z, side, k_));
  }
  // Each bounce carries at most ρ/2 of the light before it: the form factor of a wall of this corner.
  std::vector<Complex> radiosity = source, bounced(source.size());
  double scale = 0.0, change = 1.0;
  for (const Complex& value : source) scale = std::max(scale, std::abs(value));
  while (change > 1e-10 * scale) {
    change = 0.0;
    for (std::size_t i = 0; i < source.size(); ++i) {
      Complex sum;
      for (std::size_t j = 0; j < source.size(); ++j) sum += matrix_[i][j] * radiosity[j];
      bounced[i] = source[i] + albedo * sum;
      change = std::max(change, std::abs(bounced[i] - radiosity[i]));
    }
    std::swap(radiosity, bounced);
  }
  return radiosity;
}

double CornerRadiosity::error(double distance, double albedo, double u) const {
  const double side = distance / std::sqrt(2.0);
  const std::vector<Complex> radiosity = solve(side, albedo), weights = row(u, 0.0);
  Complex at_place = direct(u, 0.0, side, k_);
  for (std::size_t j = 0; j < weights.size(); ++j) at_place += albedo * weights[j] * radiosity[j];
  const double range = std::hypot(u - side, side);
  return -std::arg(at_place * std::polar(1.0, k_ * range)) / (2.0 * k_);
}

}  // namespace toftwin::sim::testing
