// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include <toftwin/result.h>

#include "calib/compare/traits/traits.h"

namespace toftwin::compare {

/// A line and the waves of these orders, as harmonicTraits() has them, with their curve: traits are the waves as
/// wavesOf() has them, "offset", "scale" and "residual". Rows that share a distance are in clusters by it.
Result<FittedTraits> fitHarmonics(Column distance_m, Column error_mm, std::span<const double> frequency_hz,
                                  std::span<const int> orders, const RowClusters& clusters);

}  // namespace toftwin::compare
