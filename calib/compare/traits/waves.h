// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/compare/traits/least_squares.h"

namespace toftwin::compare {

/// A wave of an error over distance.
struct Wave {
  double per_m = 0.0;  ///< radians per metre of distance
  std::string name{};
};

/// Of each frequency as many per period as `orders` says; those of equal length are one, under both names.
std::vector<Wave> wavesOf(std::span<const double> frequency_hz, std::span<const int> orders);

/// Why each of the `fitted` waves may be another's, in their order; empty: it is its own. At these distances
/// a wave of `left_out` shows in a fit c + s d + Σ waves as those that are fitted; it is in doubt what one of
/// them, as large and of the phase that does most, would change by over a half of itself. The fit's rows all
/// weigh the same: of a fit with errors that captures share it is an approximation. Where there are fewer
/// rows than numbers to fit, all are in doubt.
std::vector<std::string> doubtsOf(const std::vector<Wave>& fitted, const std::vector<Wave>& left_out,
                                  Column distance_m);

/// All fitted waves together, whichever they are: RMS over the rows' distances of their sum less the line that it
/// looks like. `first`: the parameter with which the waves begin, cos and sin of each. S² = βᵀQβ/n of their
/// parameters β, less what their errors V make of it by themselves, tr(QV)/n. βᵀQβ is taken as
/// tr(QV)/ν of a noncentral χ² with ν = tr²(QV)/tr(QVQV) degrees (P. B. Patnaik, Biometrika 36 (1949) 202), against an
/// error that is known by `fit.degrees`: a noncentral F distribution, whose inversion is the interval.
std::optional<Trait> wavesTogether(const Fit& fit, std::size_t first, const std::vector<Wave>& waves,
                                   Column distance_m);

/// What of a wave of 1 mm, of the phase that does most, shows in the line of such a fit: in mm at the rows' mean
/// distance, or in mm/m, and which of `left_out` it is that shows most. None where there are too few rows.
struct ShownInLine {
  double most = 0.0;
  std::string wave{};
};
struct ShownInOffsetAndScale {
  ShownInLine offset{}, scale{};
};
ShownInOffsetAndScale shownInLine(const std::vector<Wave>& fitted, const std::vector<Wave>& left_out,
                                  Column distance_m);

}  // namespace toftwin::compare
