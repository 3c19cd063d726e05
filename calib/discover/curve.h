// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "calib/discover/finder.h"

/// What an effect amounts to at given values of its covariates.
namespace toftwin::discover {

struct Point {
  double value = 0.0, error = 0.0;  ///< in the measured unit; the standard error
};
/// `at`: its covariates by name. Zero for an effect of the catalogue.
Point effectAt(const Effect& effect, const std::map<std::string, double>& at);

/// "−5.1 · exp(−time_s/301)"; "smooth curve, see its table" where there is no formula.
std::string formulaOf(const Effect& effect);

}  // namespace toftwin::discover
