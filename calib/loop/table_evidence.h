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
/// All rows that have an error, with what each may go with: the columns, the reference, and the line of the file.
/// A column of which a fifth is missing is left out; rows in which another is missing are. Notes say so.
struct TableEvidence {
  Evidence evidence{};
  std::vector<std::size_t> row{};  ///< of the readings, for each row of the evidence
  std::vector<std::size_t> begins{};  ///< lines where the reference begins anew
  Eigen::VectorXd measured{};      ///< empty where the table gives the error alone
  std::vector<std::string> notes{};
};
TableEvidence evidenceOf(const table::Readings& readings);

/// Where the reference begins anew in the file: the number of its series for each row, 0 in all where it never does or where it
/// does so all the time.
std::vector<int> seriesOf(std::span<const double> reference);

}  // namespace toftwin::loop
