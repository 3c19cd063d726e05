// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/discover/table_data.h"

/// Rows and columns that would be taken for an effect although they are none.
namespace toftwin::discover {

/// Sets rows aside, and says so in the doubts, that are no measurements of their reference:
///   - a value that stays the same in three rows or more while their references differ by far more than rows
///   err, and
///     that lies as far from all of them: a number that stands for "invalid";
///   - ranges that lie a whole number of c/(2f) off. Where the frequency is not known: three rows or more
///   that are too
///     short by the same length L, if all rows with a longer reference are and none with a shorter one is.
/// "Far" is 20 deviations of the errors. `scale`: units of the error in one of the reference.
void setInvalidAside(TableData& data, double scale);

/// Leaves out covariates that are the measured value again (range beside depth of a flat scene, a filtered
/// copy, the phase that it was made from: any straight function) or the error in a unit of length or none: they
/// explain all of it and nothing. Says so in the doubts.
void dropCopies(TableData& data, double scale);

}  // namespace toftwin::discover
