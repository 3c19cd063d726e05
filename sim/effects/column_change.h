// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "sim/effects/effect.h"
#include "sim/images/rows.h"

namespace toftwin::sim {

/// Each electron count becomes count · factor + charge, of its column. Both are as long as a row.
inline void changeColumns(Image<float>& electrons, std::span<const float> factor, std::span<const float> charge) {
  forRows(electrons.height(), [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      float* row = &electrons(0, y);
      for (std::size_t x = 0; x < factor.size(); ++x) row[x] = row[x] * factor[x] + charge[x];
    }
  });
}

}  // namespace toftwin::sim
