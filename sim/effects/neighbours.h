// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include <toftwin/frame.h>

#include "sim/images/range.h"
#include "sim/images/rows.h"

namespace toftwin::sim {

/// Calls use(range_m, dx, dy) for the valid pixels within `reach` columns and rows of (x, y), itself
/// included.
template <class Use>
void forValidAround(const Image<float>& range_m, int x, int y, int reach, const Use& use) {
  for (int dy = -reach; dy <= reach; ++dy) {
    if (y + dy < 0 || y + dy >= range_m.height()) continue;
    for (int dx = -reach; dx <= reach; ++dx) {
      if (x + dx < 0 || x + dx >= range_m.width()) continue;
      const float value = range_m(x + dx, y + dy);
      if (!std::isnan(value)) use(value, dx, dy);
    }
  }
}

/// Replaces each valid range by value(x, y), which may be NaN and must look at another image.
template <class Value>
void replaceRanges(Image<float>& range_m, const Value& value) {
  forRows(range_m.height(), [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      for (int x = 0; x < range_m.width(); ++x) {
        if (!std::isnan(range_m(x, y))) range_m(x, y) = value(x, y);
      }
    }
  });
}

/// Makes each valid pixel invalid that fails(x, y) rejects, and flags why.
template <class Fails>
void rejectWhere(RangeImage& image, PixelFlag why, const Fails& fails) {
  const auto flags = static_cast<std::uint8_t>(static_cast<unsigned>(PixelFlag::Invalid) |
                                               static_cast<unsigned>(why));
  forRows(image.range_m.height(), [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      for (int x = 0; x < image.range_m.width(); ++x) {
        if (std::isnan(image.range_m(x, y)) || !fails(x, y)) continue;
        image.range_m(x, y) = std::numeric_limits<float>::quiet_NaN();
        image.flags(x, y) = static_cast<std::uint8_t>(image.flags(x, y) | flags);
      }
    }
  });
}

}  // namespace toftwin::sim
