// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "calib/compare/progress.h"

namespace toftwin::cli {

/// A progress bar on standard error, where that is a terminal; otherwise nothing. Redrawn at most
/// ten times a second, gone when it is destroyed.
class Progress {
 public:
  /// `total` 0: not known, so it counts only.
  Progress(std::string what, std::uint64_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void show(std::uint64_t done, std::string_view extra = {});

 private:
  std::string what_;
  std::uint64_t total_;
  bool is_terminal_;
  bool drawn_ = false;
  compare::Pace pace_;
  std::chrono::steady_clock::time_point began_, drawn_at_;
};

/// From now on Ctrl-C and SIGTERM do not end the program, but make `interrupted` true.
void catchInterrupts();
bool interrupted();

}  // namespace toftwin::cli
