// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calib/compare/traits/traits.h"

namespace toftwin::compare {

/// veilTraits() of any light: `slopes_mm` is by how much a veil of 1 moves each frequency's range, a column
/// for each frequency of as many rows as `error_mm` and `cluster`. Rows with a value that is not finite are
/// left out.
Traits veilTraits(std::span<const std::vector<double>> slopes_mm, Column error_mm,
                  std::span<const double> frequency_hz, std::span<const std::size_t> cluster);

}  // namespace toftwin::compare
