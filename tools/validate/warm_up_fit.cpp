// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/warm_up_fit.h"

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "calib/compare/fits.h"

namespace toftwin::validate {
namespace {

using Vector = std::array<double, 3>;
using Matrix = std::array<Vector, 3>;

/// depth = x₀ + x₁ (−e^{−t/τ₁}) + x₂ (−e^{−t/τ₂}): the effect's own sign.
WarmUpFit linearFit(std::span<const double> time, std::span<const double> depth, double tau1,
                    double tau2, int exponentials) {
  Matrix a{};
  Vector b{};
  for (std::size_t i = 0; i < time.size(); ++i) {
    const Vector basis{1.0, exponentials > 0 ? -std::exp(-time[i] / tau1) : 0.0,
                       exponentials > 1 ? -std::exp(-time[i] / tau2) : 0.0};
    for (std::size_t k = 0; k < 3; ++k) {
      b[k] += basis[k] * depth[i];
      for (std::size_t l = 0; l < 3; ++l) a[k][l] += basis[k] * basis[l];
    }
  }
  for (int k = exponentials + 1; k < 3; ++k)
    a[static_cast<std::size_t>(k)][static_cast<std::size_t>(k)] = 1.0;
  const Vector x = compare::solve3(a, b);
  WarmUpFit fit{.warm_mm = x[0],
                .effect = {.fast = x[1] * millimetre,
                           .fast_time = tau1 * second,
                           .slow = x[2] * millimetre,
                           .slow_time = tau2 * second}};
  double squares = 0.0;
  for (std::size_t i = 0; i < time.size(); ++i)
    squares += std::pow(depth[i] - fit.depth_mm(time[i]), 2);
  fit.rms_mm = std::sqrt(squares / static_cast<double>(time.size()));
  return fit;
}

}  // namespace

double WarmUpFit::depth_mm(double time_s) const {
  return warm_mm + effect.drift(time_s * second).in(millimetre);
}

WarmUpFit fitWarmUp(std::span<const double> time_s, std::span<const double> depth_mm,
                    int exponentials) {
  std::vector<double> grid;
  for (double tau = 20.0; tau <= 3000.0; tau *= 1.15) grid.push_back(tau);
  WarmUpFit best;
  best.rms_mm = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < grid.size(); ++i) {
    for (std::size_t j = i + 1; j < grid.size(); ++j) {
      const WarmUpFit fit = linearFit(time_s, depth_mm, grid[i], grid[j], exponentials);
      if (fit.rms_mm < best.rms_mm) best = fit;
      if (exponentials < 2) break;
    }
    if (exponentials < 1) break;
  }
  return best;
}

}  // namespace toftwin::validate
