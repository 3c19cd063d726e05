// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/fits.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "calib/compare/statistics.h"

namespace toftwin::compare {
namespace {

using Vector = std::array<double, 3>;
using Matrix = std::array<Vector, 3>;

double costOf(const Vector& log_parts, std::span<const double> intensity,
              std::span<const double> sigma) {
  double cost = 0.0;
  for (std::size_t i = 0; i < intensity.size(); ++i) {
    const double v = std::exp(log_parts[0]) + std::exp(log_parts[1]) / intensity[i] +
                     std::exp(log_parts[2]) / (intensity[i] * intensity[i]);
    cost += std::pow(std::log(sigma[i]) - 0.5 * std::log(v), 2);
  }
  return cost;
}

/// JᵀJ and Jᵀr of r = ln σ − ½ ln v, v = Σ e^{p_k} I^{−k}:  ∂(½ ln v)/∂p_k = ½ e^{p_k} I^{−k} / v
std::pair<Matrix, Vector> normalEquations(const Vector& p, std::span<const double> intensity,
                                          std::span<const double> sigma) {
  Matrix jtj{};
  Vector jtr{};
  for (std::size_t i = 0; i < intensity.size(); ++i) {
    Vector part{std::exp(p[0]), std::exp(p[1]) / intensity[i],
                std::exp(p[2]) / (intensity[i] * intensity[i])};
    const double v = part[0] + part[1] + part[2];
    const double residual = std::log(sigma[i]) - 0.5 * std::log(v);
    for (double& k : part) k *= 0.5 / v;
    for (std::size_t k = 0; k < 3; ++k) {
      jtr[k] += part[k] * residual;
      for (std::size_t l = 0; l < 3; ++l) jtj[k][l] += part[k] * part[l];
    }
  }
  return {jtj, jtr};
}

}  // namespace

std::array<double, 3> solve3(Matrix a, Vector b) {
  for (std::size_t i = 0; i < 3; ++i) {
    std::size_t pivot = i;
    for (std::size_t k = i + 1; k < 3; ++k) {
      if (std::abs(a[k][i]) > std::abs(a[pivot][i])) pivot = k;
    }
    if (a[pivot][i] == 0.0) return {};
    std::swap(a[i], a[pivot]);
    std::swap(b[i], b[pivot]);
    for (std::size_t k = 0; k < 3; ++k) {
      if (k == i) continue;
      const double factor = a[k][i] / a[i][i];
      for (std::size_t l = i; l < 3; ++l) a[k][l] -= factor * a[i][l];
      b[k] -= factor * b[i];
    }
  }
  return {b[0] / a[0][0], b[1] / a[1][1], b[2] / a[2][2]};
}

double minimum1d(const std::function<double(double)>& f, double low, double high) {
  constexpr int kCoarse = 24;
  double best = low, best_value = f(low);
  const double step = (high - low) / kCoarse;
  for (int i = 1; i <= kCoarse; ++i) {
    const double x = low + step * i, value = f(x);
    if (value < best_value) best = x, best_value = value;
  }
  double a = std::max(low, best - step), b = std::min(high, best + step);
  const double ratio = (std::sqrt(5.0) - 1.0) / 2.0;
  double x1 = b - ratio * (b - a), x2 = a + ratio * (b - a), f1 = f(x1), f2 = f(x2);
  while (b - a > 1e-6 * (high - low)) {
    if (f1 < f2) {
      b = x2, x2 = x1, f2 = f1, x1 = b - ratio * (b - a), f1 = f(x1);
    } else {
      a = x1, x1 = x2, f1 = f2, x2 = a + ratio * (b - a), f2 = f(x2);
    }
  }
  return 0.5 * (a + b);
}

double NoiseLaw::sigma_mm(double intensity) const {
  return std::sqrt(a_mm * a_mm + b * b / intensity + c * c / (intensity * intensity));
}

namespace {

/// Damped Gauss-Newton from one start; the cost it ends at.
std::pair<double, Vector> descend(Vector p, std::span<const double> intensity,
                                  std::span<const double> sigma_mm) {
  double cost = costOf(p, intensity, sigma_mm), damping = 1e-3;
  for (int step = 0; step < 100 && damping < 1e9; ++step) {
    auto [jtj, jtr] = normalEquations(p, intensity, sigma_mm);
    for (std::size_t k = 0; k < 3; ++k) jtj[k][k] += damping * (jtj[k][k] + 1e-12);
    const Vector change = solve3(jtj, jtr);
    Vector next = p;
    // A part that the data do not need runs to −∞; steps are bounded so that it does not start
    // there.
    for (std::size_t k = 0; k < 3; ++k)
      next[k] = std::clamp(p[k] + std::clamp(change[k], -1.0, 1.0), -60.0, 80.0);
    const double cost_there = costOf(next, intensity, sigma_mm);
    if (cost_there < cost) {
      p = next, cost = cost_there, damping *= 0.3;
    } else {
      damping *= 4.0;
    }
  }
  return {cost, p};
}

}  // namespace

NoiseLaw fitNoiseLaw(std::span<const double> intensity, std::span<const double> sigma_mm) {
  // The valley is curved: start where each part alone explains the noise at some intensity, for all
  // combinations of a low, a middle and a high one, and keep the best end.
  const double low = quantile({intensity.begin(), intensity.end()}, 0.1),
               high = quantile({intensity.begin(), intensity.end()}, 0.9);
  const double most = quantile({sigma_mm.begin(), sigma_mm.end()}, 0.9),
               least = quantile({sigma_mm.begin(), sigma_mm.end()}, 0.1);
  std::pair<double, Vector> best{std::numeric_limits<double>::infinity(), {}};
  for (const double floor : {0.3 * least, least}) {
    for (const double shot : {0.3 * least, least, most}) {
      for (const double read : {0.3 * most, most}) {
        const auto end = descend(
            {2.0 * std::log(floor), 2.0 * std::log(shot) + std::log(shot < most ? high : low),
             2.0 * std::log(read * low)},
            intensity, sigma_mm);
        if (end.first < best.first) best = end;
      }
    }
  }
  const Vector& p = best.second;
  return {.a_mm = std::exp(0.5 * p[0]),
          .b = std::exp(0.5 * p[1]),
          .c = std::exp(0.5 * p[2]),
          .rms_log = std::sqrt(best.first / static_cast<double>(intensity.size()))};
}

}  // namespace toftwin::compare
