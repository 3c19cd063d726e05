// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/campaign/captures/frame_values.h"

#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "calib/compare/statistics.h"

namespace toftwin::discover {

double spreadOf(std::vector<double> numbers) {
  for (double& one : numbers) one = std::abs(one);
  return compare::quantile(std::move(numbers), 0.5) / 0.6745;
}

std::vector<double> withoutDrift(std::vector<double> numbers) {
  constexpr std::size_t kAllPairs = 64;
  const std::size_t n = numbers.size();
  std::vector<double> slopes;
  for (std::size_t k = n > kAllPairs ? n / 2 : 1; k < n; ++k)
    for (std::size_t i = n > kAllPairs ? k - n / 2 : 0; i < k; i += n > kAllPairs ? n : 1)
      slopes.push_back((numbers[k] - numbers[i]) / static_cast<double>(k - i));
  const double slope = compare::quantile(std::move(slopes), 0.5);
  for (std::size_t k = 0; k < n; ++k) numbers[k] -= slope * static_cast<double>(k);
  const double mean = std::accumulate(numbers.begin(), numbers.end(), 0.0) / static_cast<double>(n);
  for (double& one : numbers) one -= mean;
  return numbers;
}

Difference weightedMean(const std::vector<std::pair<double, double>>& each) {
  double sum = 0.0, weights = 0.0, squares = 0.0;
  for (const auto& [value, weight] : each) sum += weight * value, weights += weight;
  const double mean = sum / weights;
  for (const auto& [value, weight] : each) squares += weight * weight * (value - mean) * (value - mean);
  const auto n = static_cast<double>(each.size());
  return {mean, std::sqrt(squares * n / (n - 1.0)) / weights};
}

}  // namespace toftwin::discover
