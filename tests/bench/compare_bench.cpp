// SPDX-License-Identifier: Apache-2.0
// How long `toftwin compare RUN` takes: a whole run read, compared and written as a page. The run is one that
// `toftwin measure` left. Usage: compare_bench RUN [repeats]
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include <fmt/format.h>

#include "calib/plan/compare_run.h"

namespace {

namespace fs = std::filesystem;
using Seconds = std::chrono::duration<double>;

/// Of all threads, user and system, so far.
double processorSeconds() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

double peakGib() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  return static_cast<double>(used.ru_maxrss) / (1024.0 * 1024.0);
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) {
    fmt::print(stderr, "compare_bench RUN [repeats]: RUN is a folder of `toftwin measure`\n");
    return 2;
  }
  const fs::path run = arguments[1],
                 output = fs::temp_directory_path() / fmt::format("compare_bench_{}", getpid());
  const auto index = toftwin::plan::readIndex(run / toftwin::plan::kIndexFile);
  if (!index) {
    fmt::print(stderr, "{}\n", index.error().message);
    return 1;
  }
  fmt::print("{} captures, those that are locked among them; page and numbers, no log\n", index->size());
  for (int i = 0; i < (count > 2 ? std::atoi(arguments[2]) : 3); ++i) {
    toftwin::compare::Progress quiet{nullptr};
    const double before = processorSeconds();
    const auto begin = std::chrono::steady_clock::now();
    const auto page = toftwin::plan::compareRun({.run = run, .output = output, .note = {}}, quiet);
    if (!page) {
      fmt::print(stderr, "{}\n", page.error().message);
      return 1;
    }
    const double wall = Seconds{std::chrono::steady_clock::now() - begin}.count(),
                 used = processorSeconds() - before;
    fmt::print("{:.1f} s on the clock, {:.1f} s of processor time ({:.2f} cores), {:.2f} GiB at most\n", wall,
               used, used / wall, peakGib());
  }
  std::error_code ignored;
  fs::remove_all(output, ignored);
  return 0;
}
