// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/measured.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <limits>

namespace toftwin::bench {
namespace {

double msOf(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

}  // namespace

void print(const Bars& bars) {
  fmt::print("\n| bar | measured | goal | |\n| --- | --- | --- | --- |\n");
  for (const Bar& bar : bars)
    fmt::print("| {} | {} | {} | {} |\n", bar.what, bar.measured, bar.goal, bar.is_met ? "met" : "missed");
}

void giveUp(const std::string& what) {
  fmt::print(stderr, "simulator_bench: {}\n", what);
  std::exit(1);
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::ranges::sort(values);
  return values[std::min(values.size() - 1,
                         static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::ranges::sort(values);
  return 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
}

double wallMs() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}
double processorMs() { return msOf(CLOCK_PROCESS_CPUTIME_ID); }
double threadProcessorMs() { return msOf(CLOCK_THREAD_CPUTIME_ID); }

double medianOf(int runs, const std::function<void()>& work) {
  std::vector<double> times;
  for (int i = 0; i < runs; ++i) {
    const double start = processorMs();
    work();
    times.push_back(processorMs() - start);
  }
  return median(times);
}

}  // namespace toftwin::bench
