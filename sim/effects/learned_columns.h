// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sim/effects/effect.h"

namespace toftwin::sim {

/// Charges and gains of columns that repeat, as measurements showed and no other effect explains: for column class
/// j = x mod m and raw exposure k of N of each frequency, in the first tap
///     S_k → S_k (1 + g_j) + (2/N) (a_j cos θ_k + b_j sin θ_k),   θ_k = 2π k/N
/// and the gain in all taps; so that Σ S_k exp(−iθ_k) grows by a_j − i b_j, and what no wave makes of the raw
/// exposures stays. m is how many numbers a list has. What `toftwin discover` writes for stripes that have no
/// name yet.
struct LearnedColumns {
  std::vector<double> in_phase_electrons{20.0, -5.0, 0.0, 10.0};
  std::vector<double> quadrature_electrons{0.0, 15.0, -10.0, 0.0};
  std::vector<double> gains_percent{0.2, -0.1, 0.05, 0.1};

  static constexpr About about{
      .name = "learned_columns",
      .summary = "charges and gains of every m-th column learned from measurements: stripes that repeat",
      .reference = "docs/discover-campaigns.md",
      .explains = {Covariate::Ambient, Covariate::Exposure, Covariate::Amplitude, Covariate::Range,
                   Covariate::Position}};
  static LearnedColumns none() {
    return {.in_phase_electrons = {0.0}, .quadrature_electrons = {0.0}, .gains_percent = {0.0}};
  }

  template <class Visitor>
  void visit(Visitor& v) {
    v.numbers("in_phase_electrons", in_phase_electrons, {-1e9, 1e9},
              "a of each column class, the first column's first; none: 0");
    v.numbers("quadrature_electrons", quadrature_electrons, {-1e9, 1e9}, "b likewise");
    v.numbers("gains_percent", gains_percent, {-100.0, 10'000.0}, "g likewise");
  }
  /// What no single key can say of what is wrong, or nothing.
  [[nodiscard]] std::string problem() const;
  [[nodiscard]] Samples apply(Samples samples, const Conditions& now, const Random& random) const;
};

}  // namespace toftwin::sim
