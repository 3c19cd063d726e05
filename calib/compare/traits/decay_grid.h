// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "calib/compare/traits/linearised.h"

namespace toftwin::compare {

/// e^(−t/τ), by ln τ.
double decay(double t, double log_tau);

/// Time constants that rows can show: from half the first two rows' interval, of which e⁻² is left at the second, to
/// twenty times the series. Times are relative to the series' length.
double shortestDecay(Column t);
constexpr double kLongestDecay = 20.0;

/// Where a fit of exponentials begins: for each time constant of a logarithmic grid (or each pair) amplitudes
/// are a linear problem, of which the best is taken. From a start far from it Gauss and Newton's steps may
/// end in another valley, or on a plateau where a time constant runs away.
class DecayGrid {
 public:
  DecayGrid(Column t, Column y);

  /// A constant, an amplitude and ln τ; of two, the other amplitude and ln τ behind them.
  [[nodiscard]] std::vector<double> one() const;
  [[nodiscard]] std::vector<double> two() const;

 private:
  /// What amplitudes x of some columns explain, xᵀ(Bᵀy), if it is more than `most`.
  void keepBetter(const std::vector<std::size_t>& columns, double& most, std::vector<double>& best) const;

  std::vector<double> log_taus_{};
  MatrixXd products_{};  ///< BᵀB of the columns 1, e^(−t/τ₁), …
  VectorXd with_y_{};
};

}  // namespace toftwin::compare
