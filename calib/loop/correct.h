// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <toftwin/result.h>

#include "calib/compare/json.h"
#include "calib/loop/ladder.h"

namespace toftwin::loop {

/// A table with a model taken off its measured values.
struct CorrectedTable {
  std::size_t rows = 0;
  Ladder ladder{};        ///< of rows that have a reference; without one, scatter about the mean
  double rms_before = 0.0, rms_after = 0.0;  ///< of the measured, of the corrected values against the reference
  std::string csv{};      ///< the file's columns in its own units, and a last one: the corrected value
  std::vector<std::string> notes{};
};

/// Applies a model as it was written. The error of a row is that of its corrected value, which is found by turns: a table that is to
/// be corrected need not have a reference. Terms of the line of the file are only taken off the table that they were found in; a note says
/// so. Errors: what the model needs and the table lacks, by name.
Result<CorrectedTable> correctTable(const table::Readings& readings, const Model& model);

/// `rows`, `rms_before_mm`, `rms_after_mm` and the ladder's rungs.
compare::Json jsonOf(const CorrectedTable& corrected, const std::string& unit);

}  // namespace toftwin::loop
