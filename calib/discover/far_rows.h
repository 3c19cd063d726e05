// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/discover/table_data.h"

/// Gross errors of single rows: flying pixels, a wrap that nothing tells, a slip of the pen.
namespace toftwin::discover {

/// Sets few rows aside, and says in the doubts which and by how much, that are far from all others:
///   - 20 robust deviations or more from what offset, gain, sessions and each covariate's slow course say, and
///     six times as far as any other row, so that no tail ends in them;
///   - strewn among the others: neighbours in the order of a covariate, of the file, of sessions or captures that err
///     to the same side and are closer than chance would have them may be an effect that is steep there;
///   - at most 3 % of the rows, or one.
/// Where a column says which rows are locked, these are not looked at and stay.
void setFarAside(TableData& data);

}  // namespace toftwin::discover
