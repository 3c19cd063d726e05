// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "calib/table/readings.h"
#include "sim/terms/term.h"

/// Finds what measured errors go with: one search over one language of effects (sim/terms).
namespace toftwin::loop {

/// What an error may go with, as numbers: one a row.
struct Covariate {
  std::string name{};
  std::string unit{};
  table::Nature nature = table::Nature::Number;
  Eigen::VectorXd x{};                ///< of a category, the index into `words`
  std::vector<std::string> words{};   ///< of a category
  std::vector<double> sorted{};       ///< its different values, ascending
  std::vector<double> periods{};      ///< unambiguous ranges of known modulations, of a length
  double spacing = 0.0;               ///< least difference that is common between neighbouring different values
  bool is_reference = false;          ///< the reference itself
  bool goes_with_lines = false;       ///< it rises or falls with the lines of the file, nearly without exception
  bool is_order = false;              ///< the line of the file: where a series begins anew
  bool is_group_name = false;         ///< names the groups, whose offsets stand for it: not searched
  bool varies_within_groups = true;   ///< false: one number a session or capture

  [[nodiscard]] double low() const { return sorted.front(); }
  [[nodiscard]] double high() const { return sorted.back(); }
  [[nodiscard]] double span() const { return high() - low(); }
  /// The value below which that share of the rows lies.
  [[nodiscard]] double quantile(double share) const { return quantiles_[static_cast<std::size_t>(share * 200.0 + 0.5)]; }
  std::vector<double> quantiles_{};  ///< at 0, 0.5, … 100 %
};
/// Fills what follows from x: sorted, spacing, quantiles.
void describe(Covariate& covariate);

/// Name of the covariate that is the line of the file.
inline constexpr std::string_view kLine = "file_line";

/// Rows to be explained. Vectors have an entry a row.
struct Evidence {
  Eigen::VectorXd y{};          ///< error, in the table's unit
  Eigen::VectorXd sigma{};      ///< standard deviation of each row's noise, up to a common factor
  Eigen::VectorXd reference{};  ///< empty where there is none
  std::vector<int> group{};     ///< session or capture of each row: 0, 1, …; rows of one may share an offset
  std::vector<std::string> group_names{};
  std::vector<int> block{};     ///< rows that follow each other and may err alike
  int blocks = 0;
  std::vector<Covariate> covariates{};
  std::vector<double> periods{};  ///< ambiguity lengths of known modulations, in the reference's unit

  [[nodiscard]] Eigen::Index rows() const { return y.size(); }
  [[nodiscard]] int groups() const { return static_cast<int>(group_names.size()); }
  [[nodiscard]] const Covariate* find(std::string_view name) const;
};

/// The rows whose numbers are given, in that order.
Evidence rowsOf(const Evidence& all, std::span<const Eigen::Index> rows);

/// Numbers of about `most` of so many rows, all if they are no more, in their order. Steps between them that differ do not alias a
/// short period of the rows.
std::vector<Eigen::Index> thinned(Eigen::Index rows, Eigen::Index most);

/// Gives the blocks: at most `most` of them, of rows that follow each other within a group, none shorter than `length`.
void block(Evidence& evidence, Eigen::Index length, int most);

/// A column of the design: the product of these factors at each row.
using Product = std::vector<terms::Factor>;
Eigen::VectorXd columnOf(const Evidence& evidence, const Product& product);
Eigen::MatrixXd columnsOf(const Evidence& evidence, std::span<const Product> products);

}  // namespace toftwin::loop
