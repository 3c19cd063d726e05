// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/compare/traits/least_squares.h"
#include "calib/compare/traits/odd_rows.h"
#include "calib/compare/traits/traits.h"

namespace toftwin::compare {

/// Odd rows of a series whose times go from 0 to 1, as that model has them which explains the series best beside them
/// (BIC, two parameters for each odd row). None where the model that was fitted to all rows has none. To that one two
/// rows that are far off look like a step there and back, and then a good row beside them is odd.
OddRows oddRowsOfSeries(DriftModel fitted, const Fit& fit, Column t, Column y);

}  // namespace toftwin::compare
