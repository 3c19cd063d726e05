// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/discover/row_dependence.h"
#include "calib/discover/rows_alike.h"
#include "calib/discover/table_data.h"
#include "calib/discover/term.h"

namespace toftwin::discover {

/// What the rows of a table err by beyond anything smooth.
struct TableNoise {
  std::vector<double> sigma{};    ///< of each row, in the error's unit
  std::vector<double> weight{};   ///< 1, and less for rows that lie far off (Huber's weights)
  /// Of what rows scatter by over sigma. A wander of many rows that may be there is in sigma, so that the search heeds
  /// it; where it is not clear, rows are told and judged by what they scatter by.
  double scatter = 1.0;
  double typical = 0.0;           ///< median of what they scatter by
  /// Of rows that follow each other; nothing where captures say which rows err together.
  std::optional<RowDependence> dependence{};
  std::size_t outliers = 0;       ///< rows beyond three deviations
  std::string grows_with{};       ///< covariate that sigma goes with, or empty
  /// Over so many rows that follow each other they err alike.
  [[nodiscard]] double correlationRows() const {
    return dependence ? dependence->best.correlation.rows() : 1.0;
  }
};

/// A table as a source of evidence. Captures are what a column names, or blocks of rows that follow each
/// other, of which each says what it says beyond those before it.
class TableSource : public RowSource {
 public:
  /// The rows are copied; locked ones must not be among them.
  TableSource(TableData data, bool fits_gain);

  [[nodiscard]] Evidence evidence(std::span<const TermGroup> extra) const override;
  [[nodiscard]] Evidence summed(std::span<const TermGroup> extra,
                                std::span<const double> scales) const override;
  /// Noise of each correlation that the rows may have, as often as it is likely.
  [[nodiscard]] Eigen::MatrixXd nullMoments(std::span<const TermGroup> extra, int draws,
                                            std::uint64_t seed) const override;
  [[nodiscard]] std::vector<CovariateInfo> covariates() const override { return infos_; }

  /// Estimates the noise anew, with these terms beside what is smooth: what they explain is no noise.
  void learn(std::span<const Term> known);
  [[nodiscard]] const TableData& data() const { return data_; }
  [[nodiscard]] const TableNoise& noise() const { return noise_; }
  /// The covariate whose runs of equal values are captures, since rows of one err alike; empty: none.
  [[nodiscard]] const std::string& runsOf() const { return runs_of_; }
  [[nodiscard]] bool hasCaptures() const { return has_captures_; }
  /// Each session, or each of few captures, has a free offset.
  [[nodiscard]] bool hasSessions() const { return has_sessions_; }
  [[nodiscard]] std::size_t captures() const { return names_.size(); }
  /// Number of each row's capture.
  [[nodiscard]] const std::vector<int>& captureOf() const { return capture_; }
  /// Columns of the nuisances for rows of this or another table (locked ones): names as in the evidence.
  [[nodiscard]] std::vector<std::pair<Group, Eigen::MatrixXd>> nuisanceColumns(const TableData& rows) const;

 private:
  void makeCaptures();
  [[nodiscard]] Eigen::MatrixXd nuisancesOf(const TableData& rows) const;
  [[nodiscard]] Eigen::MatrixXd designOf(std::span<const TermGroup> extra, std::vector<Group>& groups) const;
  [[nodiscard]] Eigen::MatrixXd standardised(Eigen::MatrixXd rows) const;
  [[nodiscard]] Evidence evidenceOf(std::span<const TermGroup> extra, const std::vector<int>& capture,
                                    std::size_t captures) const;

  TableData data_;
  bool fits_gain_ = false;
  bool has_captures_ = false;  ///< a column names them, and they have several rows; or they are the sessions
  bool has_sessions_ = false;  ///< each session has an offset of its own
  double reference_middle_ = 0.0, reference_spread_ = 1.0, error_spread_ = 1.0;
  std::vector<CovariateInfo> infos_;
  TableNoise noise_;
  std::optional<RowWhitening> whitening_;
  std::string runs_of_{};
  std::vector<int> capture_;
  std::vector<std::string> names_, blocks_;
};

/// Values of terms for all rows, one column a term.
Eigen::MatrixXd columnsOf(const TableData& data, std::span<const Term> terms);
std::vector<CovariateInfo> infosOf(const TableData& data);

/// Runs of equal values whose rows err alike beyond what is known and slow (by more than 2.5 standard
/// deviations), the clearest ones.
std::optional<Runs> alikeRuns(const TableData& data, const std::vector<CovariateInfo>& infos,
                              const Eigen::MatrixXd& known);

/// Noise of a table from what is left after a flexible fit of everything smooth: weights and deviations in
/// turn (P. J. Huber, Ann. Math. Stat. 35 (1964) 73; k = 3). `known`: columns that are there for certain,
/// nuisances among them. `clocks`: in which order rows may err alike; none where captures say it.
TableNoise estimateNoise(const TableData& data, const std::vector<CovariateInfo>& infos,
                         const Eigen::MatrixXd& known, const std::vector<RowClock>& clocks);

}  // namespace toftwin::discover
