// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "calib/compare/statistics.h"

/// Fitting on one half of the data and judging on the other.
namespace toftwin::validate {

/// Rows fall into numbered blocks; even blocks are fitted, odd ones are judged. A negative block is
/// neither.
using Blocks = std::vector<int>;
/// Blocks of `size` rows that follow each other, or of `size` along a quantity.
Blocks blocksOfRows(std::size_t rows, std::size_t size);
Blocks blocksAlong(std::span<const double> x, double size);
/// What a prediction leaves of the judged rows that it says something of, root mean square.
double judgedRms(std::span<const double> y, std::span<const double> prediction, const Blocks& blocks);
inline bool isFitted(int block) { return block >= 0 && block % 2 == 0; }
inline bool isJudged(int block) { return block >= 0 && block % 2 == 1; }

/// y ≈ Σ value · column. One column is one cause.
struct Term {
  std::string name;
  std::vector<double> column;
};

struct LinearFit {
  std::vector<double> value;
  /// Standard errors by leaving out one fitted block after the other (jackknife): neighbouring rows
  /// err alike, so the usual formula would be far too small.
  std::vector<double> error;
  std::vector<double> prediction;  ///< for all rows
  double fitted_rms = 0.0, judged_rms = 0.0;
  std::size_t fitted_n = 0, judged_n = 0;
};
/// Least squares over the fitted blocks, where y and all columns are finite. Terms that the data
/// cannot tell apart get the smallest values (a ridge of 1e-9 of each column's size).
LinearFit fitLinear(std::span<const double> y, std::span<const Term> terms, const Blocks& blocks);

/// Adds terms from `groups` (a group enters as a whole) as long as cross-validation within the
/// fitted half gains at least 2 %: leave out every fourth fitted block in turn. Judged blocks are
/// never looked at. Gives the chosen groups in order.
std::vector<std::size_t> chooseGroups(std::span<const double> y, const std::vector<Term>& always,
                                      const std::vector<std::vector<Term>>& groups,
                                      const Blocks& blocks, std::size_t at_most);

/// A model with numbers that enter in any way: predict(numbers) for all rows. Minimises the fitted
/// blocks' mean square by Gauss-Newton with damping; errors by the jackknife over blocks.
struct CurveFit {
  std::vector<double> value, error, prediction;
  double fitted_rms = 0.0, judged_rms = 0.0;
  std::size_t fitted_n = 0, judged_n = 0;
};
using Predict = std::function<std::vector<double>(std::span<const double>)>;
struct Bounded {
  double start, low, high;
};
CurveFit fitCurve(std::span<const double> y, std::span<const Bounded> numbers,
                  const Predict& predict, const Blocks& blocks);

/// "12.3 ± 0.4".
std::string shownFitted(double value, double error, int decimals = 1);

}  // namespace toftwin::validate
