// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/loop/evidence.h"

namespace toftwin::loop {

/// Name of the reference in terms: what the simulator calls the range, where the table's unit is one of length.
std::string_view rangeName(const table::Readings& readings);
/// What terms of the error add to: the range, or values in the table's own unit.
terms::Quantity quantityOf(const table::Readings& readings);
/// Header of the column whose rows share an offset: captures', else sessions'; empty if there is none.
const std::string& groupColumn(const table::Readings& readings);
/// The header behind a name of a term: the reference is called range_mm in terms.
std::string headerOf(const table::Readings& readings, const std::string& covariate);
std::vector<std::string> headersOf(const table::Readings& readings, const std::vector<std::string>& covariates);

/// All rows that have an error, with what each may go with: the columns, the reference, and the line of the file.
/// A column of which a fifth is missing is left out; rows in which another is missing are. Notes say so.
struct TableEvidence {
  Evidence evidence{};
  std::vector<std::size_t> row{};  ///< of the readings, for each row of the evidence
  std::vector<std::size_t> begins{};  ///< lines where the reference begins anew
  Eigen::VectorXd measured{};      ///< empty where the table gives the error alone
  std::vector<std::string> notes{};

  /// Whether it says what should have been measured. Without, nobody knows what is constant: what was measured is what is there.
  [[nodiscard]] bool hasTruth() const { return evidence.reference.size() > 0 || measured.size() == 0; }
};
TableEvidence evidenceOf(const table::Readings& readings);
/// Puts the rows into the groups that the table names, captures or sessions: numbers in the order that they come.
void giveGroups(TableEvidence& table, const table::Readings& readings);

/// Where the reference begins anew in the file: the number of its series for each row, 0 in all where it never does or where it
/// does so all the time.
std::vector<int> seriesOf(std::span<const double> reference);

}  // namespace toftwin::loop
