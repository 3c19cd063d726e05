// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <toftwin/image.h>

#include "calib/compare/json.h"

namespace toftwin::compare {

/// What a sample of numbers looks like, in the unit of the numbers. Values that are not finite are
/// left out and not counted. `mean` is the signed bias where the numbers are errors.
struct Summary {
  std::size_t n = 0;
  double mean = 0.0;
  double sd = 0.0;              ///< with n − 1; NaN for n < 2
  /// Of the mean: sd/√n, which takes the values as independent. Where they are not, clusteredError
  /// or blockedError stands here instead.
  double standard_error = 0.0;
  double rms = 0.0;             ///< root of the mean square, about zero
  double median = 0.0;
  double p95_abs = 0.0;  ///< 95 % of the magnitudes are at most this
  double min = 0.0;
  double max = 0.0;
};
/// All fields but `n` are NaN when no value is finite.
Summary summarise(std::span<const double> values);
Json toJson(const Summary& summary, const char* unit);

/// Standard error of the mean of values that err alike within a cluster, such as the pixels of one
/// pose. With the clusters' sizes n_c, N = Σ n_c, means m_c, the mean m̄ of all values, and the variance w_c of
/// values within each (of single ones that within all):
///   s² = (Σ n_c (m_c − m̄)² − Σ w_c (1 − n_c/N)) / (N − Σ n_c²/N)      error² = s² Σ n_c² / N² + Σ n_c w_c / N²
/// It is the error of a mean weighted by n_c whose clusters vary by s (one-way random effects, analysis of
/// variance: a cluster of few values, whose mean is off by their own scatter, says little of s): that of the
/// means over √G for G equal clusters. NaN for fewer than two clusters, and where the mean is of little more than one:
/// N² / Σ n_c² < 1.5, as where one of two holds over 79 %; error² may be (mean of values²) / (N² / Σ n_c² − 1).
/// `cluster` holds small numbers, one for each value; values that are not finite are left out.
double clusteredError(std::span<const double> values, std::span<const std::uint32_t> cluster);

/// Standard error of the mean of a field whose neighbours err alike, however far: clusteredError for
/// square blocks of 1, 2, 4, … pixels as long as there are 8 of them, and the largest of these.
/// It stops growing when the blocks are larger than the correlation length (H. Flyvbjerg,
/// H. G. Petersen, J. Chem. Phys. 91 (1989) 461); where it never stops, it is a lower bound. Eight
/// blocks know it to 1/√(2·7) = 27 %. NaN for fewer than 16 values, which leave nothing to block.
double blockedError(const Image<float>& field);
/// The same for a series in its order.
double blockedError(std::span<const double> series);

/// The q-quantile (0 … 1), linearly interpolated between order statistics; NaN for no values.
double quantile(std::vector<double> values, double q);

/// The mean of the values that lie within `reach` of it, found from 0 on (mean shift; K. Fukunaga, L. D.
/// Hostetler, IEEE Trans. Inf. Theory 21 (1975) 32): what is cut off lies as far to one side as to the other.
/// 0 where none lies within `reach` of 0.
double meanWithin(std::span<const double> values, double reach);

/// How much of a measured error e a prediction p explains, over pairs where both are finite.
///   raw:       1 − Σ(e − p)² / Σe²                     against predicting no error at all
///   centred:   1 − Var(e − p) / Var(e)                 after the best constant is removed from
///   both
/// 1 is all of it, 0 nothing; negative when the prediction is worse than none.
struct Explained {
  std::size_t n = 0;
  double measured_rms = 0.0;  ///< √(Σe²/n): the error of "no simulation"
  double residual_rms = 0.0;  ///< √(Σ(e − p)²/n)
  double measured_sd = 0.0;   ///< after its mean is removed
  double residual_sd = 0.0;   ///< after its mean is removed
  double best_offset = 0.0;   ///< mean of e − p: the constant that the prediction lacks
  double fraction_raw = 0.0;
  double fraction_centred = 0.0;
};
Explained explain(std::span<const double> measured_error, std::span<const double> predicted_error);
Json toJson(const Explained& explained);

/// Mean and variance of one pixel over repeated frames, by Welford's updates: exact for any count
/// without keeping the frames.
class Running {
 public:
  void add(double value) {
    ++n_;
    const double step = value - mean_;
    mean_ += step / static_cast<double>(n_);
    m2_ += step * (value - mean_);
  }
  [[nodiscard]] std::size_t n() const { return n_; }
  [[nodiscard]] double mean() const { return mean_; }
  /// With n − 1; 0 for fewer than two values.
  [[nodiscard]] double variance() const { return n_ < 2 ? 0.0 : m2_ / static_cast<double>(n_ - 1); }

 private:
  std::size_t n_ = 0;
  double mean_ = 0.0;
  double m2_ = 0.0;
};

}  // namespace toftwin::compare
