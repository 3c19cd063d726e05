// SPDX-License-Identifier: Apache-2.0
// What the parts of simulator_bench share: goals beside what was measured, clocks, quantiles.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::bench {

/// A goal beside what was measured of it.
struct Bar {
  std::string what, measured, goal;
  bool is_met = false;
};
using Bars = std::vector<Bar>;

/// As a table.
void print(const Bars& bars);

[[noreturn]] void giveUp(const std::string& what);
template <class T>
T orGiveUp(Result<T> result) {
  if (!result) giveUp(result.error().message);
  return *std::move(result);
}

/// NaN of nothing.
double quantile(std::vector<double> values, double share);
/// Of an even number of values the mean of the two in the middle.
double median(std::vector<double> values);

double wallMs();
double processorMs();        ///< of the whole process
double threadProcessorMs();  ///< of this thread, which does all the work
/// Median of the process's processor time [ms].
double medianOf(int runs, const std::function<void()>& work);

}  // namespace toftwin::bench
