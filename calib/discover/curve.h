// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/discover/finder.h"
#include "calib/discover/table_data.h"

/// What an effect amounts to at given values of its covariates.
namespace toftwin::discover {

struct Point {
  double value = 0.0, error = 0.0;  ///< in the measured unit; the standard error
};
/// What an effect is on average over some rows, and the slope of that by its numbers. Beside it a curve is
/// known as well as its data are: beside zero it has the error of the offset, too.
struct Level {
  double value = 0.0;
  Eigen::VectorXd slope{};
};
Level levelOf(const Effect& effect, const TableData& rows);

/// `at`: its covariates by name. Zero for an effect of the catalogue. Above `level`, if one is given.
Point effectAt(const Effect& effect, const std::map<std::string, double>& at, const Level& level = {});

/// Of each row.
std::vector<double> effectIn(const TableData& rows, const Effect& effect);

/// The values of a covariate next to a place, below it and from it on: all that rows say of where a step is.
std::pair<double, double> rowsAround(const TableData& rows, const std::string& covariate, double place);
/// A step is between two rows.
struct StepRows {
  std::string covariate{};
  double below = 0.0, from = 0.0;
};
/// Of the number at this place of effect.numbers, if it is the place of a step.
std::optional<StepRows> stepRows(const TableData& rows, const Effect& effect, std::size_t number);

/// "−5.1 · exp(−time_s/301)"; "smooth curve, see its table" where there is no formula.
std::string formulaOf(const Effect& effect);

}  // namespace toftwin::discover
