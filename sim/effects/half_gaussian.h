// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

namespace toftwin::sim {

/// One half of a sampled Gaussian that sums to one, out to four standard deviations.
inline std::vector<float> halfGaussian(double sigma) {
  const auto reach = static_cast<std::size_t>(std::ceil(4.0 * sigma));
  std::vector<float> half(reach + 1);
  double sum = 0.0;
  for (std::size_t i = 0; i <= reach; ++i) {
    const double value = std::exp(-0.5 * static_cast<double>(i * i) / (sigma * sigma));
    half[i] = static_cast<float>(value);
    sum += i == 0 ? value : 2.0 * value;
  }
  for (float& value : half) value /= static_cast<float>(sum);
  return half;
}

}  // namespace toftwin::sim
