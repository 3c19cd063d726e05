// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace toftwin::compare {

/// Says what a long job does and how long is left. Steps are announced beforehand with their
/// expected seconds; the rest is scaled by how long the finished ones really took.
class Progress {
 public:
  /// Writes to `out`, or nothing at all if that is null.
  explicit Progress(std::FILE* out) : out_(out) {}
  void plan(std::string step, double expected_s) {
    steps_.emplace_back(std::move(step), expected_s);
  }
  /// The next planned step begins.
  void begin();
  /// A word about the running step: how much of it is done (0 … 1).
  void at(double share);
  /// All steps are done.
  void end();

 private:
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] double left(double share) const;
  void line(double share);

  std::FILE* out_;
  std::vector<std::pair<std::string, double>> steps_;
  std::size_t next_ = 0;
  Clock::time_point started_ = Clock::now();
  Clock::time_point said_{};
  bool on_terminal_ = false;
};

}  // namespace toftwin::compare
