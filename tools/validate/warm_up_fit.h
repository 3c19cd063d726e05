// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "sim/effects/warm_up.h"

namespace toftwin::validate {

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

}  // namespace toftwin::validate
