// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/compare/progress.h"

namespace toftwin::cli {

/// "50 s", "12 min", "3 h 20 min".
std::string timeLeft(double seconds);

/// A progress bar on standard error, where that is a terminal; otherwise nothing, or a line now and then. Redrawn
/// at most ten times a second, gone when it is destroyed.
class Progress {
 public:
  /// `total` 0: not known, so it counts only. `log_every` 0: nothing where there is no terminal.
  Progress(std::string what, std::uint64_t total, std::chrono::seconds log_every = {});
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  /// How much work each of them is, where they are not alike: what is left is told by it, in any unit.
  void weigh(std::vector<double> work) { work_ = std::move(work); }
  void show(std::uint64_t done, std::string_view extra = {}) { show(done, 0.0, extra); }
  /// So many are done, and that share of the next.
  void show(std::uint64_t done, double share_of_next, std::string_view extra);

 private:
  [[nodiscard]] std::string line(double done, std::string_view extra);
  [[nodiscard]] double workOf(double done) const;

  std::string what_;
  std::uint64_t total_;
  std::chrono::seconds log_every_;
  bool is_terminal_;
  bool drawn_ = false;
  std::vector<double> work_;  ///< empty: 1 each
  compare::Pace pace_;
  std::chrono::steady_clock::time_point began_, drawn_at_;
};

/// Shows what was printed now. Throws std::system_error where it cannot be written, as fmt::print does.
void flushOutput();

/// From now on Ctrl-C and SIGTERM do not end the program, but make `interrupted` true.
void catchInterrupts();
bool interrupted();

}  // namespace toftwin::cli
