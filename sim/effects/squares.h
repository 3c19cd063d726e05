// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "sim/images/box_mean.h"

/// Kernels that were learned as a sum of squares, each with the reach of its side and its share of the light.
namespace toftwin::sim {

/// Why they are no kernel; empty if they are one.
inline std::string problemOfSquares(const std::vector<double>& reaches_px,
                                    const std::vector<double>& shares_percent) {
  if (reaches_px.size() == shares_percent.size()) return {};
  return "has " + std::to_string(shares_percent.size()) + " shares_percent for " +
         std::to_string(reaches_px.size()) + " reaches_px: one for each";
}

/// `add(mean, share)` for each square: the image's means over it, and its share of one.
template <class T, class Add>
void forEachSquare(const Image<T>& source, const std::vector<double>& reaches_px,
                   const std::vector<double>& shares_percent, const Add& add) {
  for (std::size_t k = 0; k < reaches_px.size(); ++k) {
    if (shares_percent[k] == 0.0) continue;
    add(boxMean(source, static_cast<int>(std::lround(reaches_px[k]))),
        static_cast<float>(0.01 * shares_percent[k]));
  }
}

}  // namespace toftwin::sim
