// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace toftwin::sim {

/// r + t(r) = u solved for r at many places beforehand, where t goes with the range alone: where to begin to look for the others. In
/// millimetres. It is a guess: beside jumps, and where t folds back, it may be far off.
class RangeGuess {
 public:
  /// Writes t of each range into `sums`.
  using Errors = std::function<void(std::span<const double> range_mm, std::span<double> sums)>;
  RangeGuess() = default;
  explicit RangeGuess(const Errors& errors);

  [[nodiscard]] bool isEmpty() const { return ranges_.empty(); }
  /// r of each u; u itself outside of 0.1 to 12 m.
  void of(std::span<const double> u_mm, std::span<double> range_mm) const;

 private:
  std::vector<double> ranges_;  ///< at equal steps of u
};

}  // namespace toftwin::sim
