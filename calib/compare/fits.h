// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <functional>
#include <span>
#include <vector>

#include "sim/effects/warm_up.h"

namespace toftwin::compare {

/// Solves the 3 × 3 system a x = b by elimination with pivoting; zeros if it is singular.
std::array<double, 3> solve3(std::array<std::array<double, 3>, 3> a, std::array<double, 3> b);

/// Where a function of one variable is smallest between two bounds: a coarse search and then the
/// golden section, to a millionth of the span.
double minimum1d(const std::function<double(double)>& f, double low, double high);

/// σ(I) = √(a² + b²/I + c²/I²): a floor, shot noise and read noise over the signal I.
struct NoiseLaw {
  double a_mm = 0.0, b = 0.0, c = 0.0;
  double rms_log = 0.0;  ///< √mean (ln σ − ln law)²: 0.1 means about 10 %
  [[nodiscard]] double sigma_mm(double intensity) const;
};
/// Least squares in ln σ, by damped Gauss-Newton in ln a², ln b², ln c²: every part stays positive.
NoiseLaw fitNoiseLaw(std::span<const double> intensity, std::span<const double> sigma_mm);

/// depth(t) = warm + drift(t) with the simulator's own warm-up effect.
struct WarmUpFit {
  double warm_mm = 0.0;
  sim::WarmUp effect;
  double rms_mm = 0.0;
  [[nodiscard]] double depth_mm(double time_s) const;
};
/// Least squares: for each pair of time constants of a logarithmic grid (20 … 3000 s,
/// `exponentials` 1 or 2 of them) the amplitudes are a linear problem. 0 exponentials: a constant,
/// "no drift".
WarmUpFit fitWarmUp(std::span<const double> time_s, std::span<const double> depth_mm,
                    int exponentials);

}  // namespace toftwin::compare
