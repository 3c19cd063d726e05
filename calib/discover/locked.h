// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/compare/statistics.h"
#include "calib/discover/finder.h"
#include "calib/discover/table_source.h"

/// Before and after, on rows that nothing else has seen.
namespace toftwin::discover {

struct Judged {
  std::size_t rows = 0, captures = 0;
  std::string sha256{};                ///< of the locked rows, from before the search
  compare::Summary before{}, after{};  ///< offset and gain removed from both
  std::vector<double> before_value{}, after_value{};
  /// Of what can be explained: (χ²_before − χ²_after)/(χ²_before − rows), with χ² in units of the noise,
  /// without the rows that are far off both before and after, of which no model could make anything; 95 %
  /// interval by drawing captures anew.
  double removed = 0.0, removed_low = 0.0, removed_high = 0.0;
  double explainable = 0.0;                      ///< χ²_before − rows
  double explainable_error = 0.0;                ///< what chance alone makes of it
  std::size_t far_off = 0;                       ///< rows that are not in these
  /// Whether the share says something: there is more to explain than chance makes, and not much more is gone
  /// than there was, which no model can do.
  [[nodiscard]] bool isTelling() const { return explainable > 3.0 * explainable_error && removed <= 1.3; }
  double noise_before = 0.0, noise_after = 0.0;  ///< χ²/rows
  double lag1_before = 0.0, lag1_after = 0.0;    ///< correlation of rows that follow each other
};

/// `plain`: nuisances fitted without effects; `finding`: with them. Both on the rows that are not locked.
Judged judgeLocked(const TableSource& source, const TableData& locked, const std::vector<Estimate>& plain,
                   const Finding& finding);

/// Nuisances alone.
std::vector<Estimate> fitNuisances(const TableSource& source, std::span<const double> scales);

/// What effects and nuisances amount to in each row.
std::vector<double> predicted(const TableSource& source, const TableData& rows,
                              const std::vector<Estimate>& nuisances, const std::vector<Effect>& effects);

}  // namespace toftwin::discover
