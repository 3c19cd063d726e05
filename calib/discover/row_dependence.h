// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "calib/discover/table_data.h"

/// Errors that follow each other: white noise and an AR(1) process together.
namespace toftwin::discover {

/// The order of the rows in which errors may follow each other, and how far each is from the one before.
struct RowClock {
  std::string name{};                 ///< a covariate that is a time; empty: the file's lines
  std::vector<Eigen::Index> order{};  ///< the rows, session by session
  std::vector<double> step{};         ///< of each of these, in median steps; infinite where a session begins
};
/// The file's lines, so that rows that were left out or locked are a gap, and each covariate that is a time.
std::vector<RowClock> clocksOf(const TableData& data);

/// Of a variance of 1: a share q is the AR(1) process, the rest is white.
struct RowCorrelation {
  double share = 0.0;      ///< q
  double neighbour = 0.0;  ///< ρ of the process over one median step; ρ^Δ over a step of Δ
  /// Over how many rows errors are alike: 1 + 2 Σ ρ_k.
  [[nodiscard]] double rows() const { return 1.0 + 2.0 * share * neighbour / (1.0 - neighbour); }
};

/// L⁻¹, where L Lᵀ is the correlation of the rows: what each row says beyond those before it, by a Kalman
/// filter of the process, in units of its deviation (R. H. Jones, Technometrics 22 (1980) 389).
class RowWhitening {
 public:
  RowWhitening(const RowClock& clock, const RowCorrelation& correlation);
  /// L⁻¹ of each column; rows stay where they are.
  [[nodiscard]] Eigen::MatrixXd whitened(const Eigen::MatrixXd& rows) const;
  /// L of each column: white noise becomes noise of this correlation.
  [[nodiscard]] Eigen::MatrixXd coloured(const Eigen::MatrixXd& rows) const;
  /// ln det L Lᵀ
  [[nodiscard]] double logDeterminant() const;

 private:
  struct Step {
    Eigen::Index row = 0;
    double decay = 0.0, gain = 0.0;  ///< of the process; of the filter
    double deviation = 1.0;          ///< of the row, given those before it
  };
  std::vector<Step> steps_;
};

/// One correlation that the rows may have.
struct LikelyCorrelation {
  RowCorrelation correlation{};
  double weight = 0.0;    ///< its share of the likelihood of all that were tried
  double variance = 1.0;  ///< of a row, if it is this one
};
struct RowDependence {
  RowClock clock{};
  LikelyCorrelation best{};
  double falls_by = 0.0;  ///< −2 ln L from white noise to the best
  double white = 1.0;     ///< variance of a row, if none follows another
  /// By 9.2 and more it falls by chance in one table of a hundred (χ² with two degrees of freedom).
  [[nodiscard]] bool isClear() const { return falls_by > 9.2; }
  std::vector<LikelyCorrelation> likely{};  ///< those with a thousandth of the best one's weight or more
};

/// By restricted maximum likelihood, the coefficients of `columns` integrated out (D. A. Harville, J. Am.
/// Stat. Assoc. 72 (1977) 320), over a grid of q and ρ and over the clocks, white noise among them. Nothing
/// where there is no clock. `y`, `columns`: rows divided by what is known of their deviation.
std::optional<RowDependence> dependenceOf(const std::vector<RowClock>& clocks, const Eigen::VectorXd& y,
                                          const Eigen::MatrixXd& columns);

}  // namespace toftwin::discover
