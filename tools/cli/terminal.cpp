// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/terminal.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>

namespace toftwin::cli {
namespace {

constexpr int kBarWidth = 30;
std::atomic<bool> g_interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set by a signal handler");

}  // namespace

Progress::Progress(std::string what, std::uint64_t total)
    : what_(std::move(what)),
      total_(total),
      is_terminal_(::isatty(STDERR_FILENO) == 1),
      began_(std::chrono::steady_clock::now()) {}

Progress::~Progress() {
  if (drawn_) fmt::print(stderr, "\r\033[K");
}

void Progress::show(std::uint64_t done, std::string_view extra) {
  const auto now = std::chrono::steady_clock::now();
  if (!is_terminal_ ||
      (drawn_ && now - drawn_at_ < std::chrono::milliseconds{100} && done != total_))
    return;
  drawn_ = true;
  drawn_at_ = now;
  const double seconds = std::chrono::duration<double>(now - began_).count();
  std::string line = fmt::format("{} {}", what_, done);
  if (total_ > 0) {
    const auto filled = static_cast<int>(kBarWidth * std::min(done, total_) / total_);
    pace_.at(seconds, static_cast<double>(done));
    const auto left = pace_.left(static_cast<double>(total_ - std::min(done, total_)));
    line = fmt::format("{} [{:#<{}}{:.<{}}] {}/{}{}", what_, "", filled, "", kBarWidth - filled,
                       done, total_, left ? fmt::format(", {:.0f} s left", std::ceil(*left)) : "");
  }
  fmt::print(stderr, "\r\033[K{}{}{}", line, extra.empty() ? "" : ", ", extra);
  std::fflush(stderr);
}

void catchInterrupts() {
  struct sigaction action {};
  action.sa_handler = [](int) { g_interrupted = true; };
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() { return g_interrupted; }

}  // namespace toftwin::cli
