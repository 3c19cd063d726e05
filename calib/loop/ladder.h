// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <toftwin/result.h>

#include "calib/loop/model.h"

namespace toftwin::loop {

/// What is left of the errors after a model of growing size.
struct Step {
  std::string name{};  ///< "raw", "constant", "gain", "series", "effects"
  double rms = 0.0, p95 = 0.0;  ///< in the table's unit; 95 % of magnitudes are within p95
};
struct Ladder {
  std::size_t rows = 0;
  bool has_truth = true;  ///< false: without a reference, so that all are scatter about the mean
  std::vector<Step> steps{};
  [[nodiscard]] double first() const { return steps.empty() ? 0.0 : steps.front().rms; }
  [[nodiscard]] double last() const { return steps.empty() ? 0.0 : steps.back().rms; }
};

/// What the model's terms leave of these rows' errors, rung by rung. A rung that needs what the table lacks is left out; without a
/// reference, which tells what is constant and how large a gain is, all but the first and the last are.
Ladder ladderOf(const TableEvidence& table, const Model& model);

/// Of rows in which everything is the same, by how much they scatter; 0 where hardly any are.
struct Repeats {
  double deviation = 0.0;
  std::size_t rows = 0;
};
Repeats repeatsOf(const Evidence& evidence);

/// The rows whose numbers are given, as a table of their own.
TableEvidence rowsOf(const TableEvidence& table, const std::vector<Eigen::Index>& rows);

}  // namespace toftwin::loop
