// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace toftwin::compare {

/// How fast a job goes and how long is left. Older work counts less and less, so that it follows a
/// job that becomes slower or faster; yet half of all that passed still counts, so that it is calm.
class Pace {
 public:
  Pace() = default;
  /// At first as if `seconds` had gone at that rate.
  Pace(double rate, double seconds) : done_(rate * seconds), seconds_(seconds) {}
  /// So much is done after so many seconds; both since the start, and not less than before.
  void at(double seconds, double done);
  /// Seconds for what is left; nothing while that cannot be told.
  [[nodiscard]] std::optional<double> left(double work) const;

 private:
  double done_ = 0.0, seconds_ = 0.0;  ///< remembered
  double last_done_ = 0.0, last_s_ = 0.0;
};

/// Says what a long job does and how long is left. Steps are announced beforehand with their
/// expected seconds; the rest is scaled by how long the finished work really took.
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
  [[nodiscard]] double left(double share);
  void line(double share);

  std::FILE* out_;
  std::vector<std::pair<std::string, double>> steps_;
  std::size_t next_ = 0;
  Clock::time_point started_ = Clock::now();
  Clock::time_point said_{};
  bool on_terminal_ = false;
  Pace pace_{1.0, 10.0};  ///< planned seconds per second; as planned until it has gone for some
};

}  // namespace toftwin::compare
