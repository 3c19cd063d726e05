// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

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

}  // namespace toftwin::compare
