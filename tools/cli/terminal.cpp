// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/terminal.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <system_error>

namespace toftwin::cli {
namespace {

constexpr int kBarWidth = 30;
std::atomic<bool> g_interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set by a signal handler");

}  // namespace

std::string timeLeft(double seconds) {
  if (seconds < 90.0) return fmt::format("{:.0f} s", std::ceil(seconds));
  const auto minutes = static_cast<std::int64_t>(std::ceil(seconds / 60.0));
  if (minutes < 90) return fmt::format("{} min", minutes);
  return fmt::format("{} h {} min", minutes / 60, minutes % 60);
}

Progress::Progress(std::string what, std::uint64_t total, std::chrono::seconds log_every)
    : what_(std::move(what)),
      total_(total),
      log_every_(log_every),
      is_terminal_(::isatty(STDERR_FILENO) == 1),
      began_(std::chrono::steady_clock::now()),
      drawn_at_(began_) {}

Progress::~Progress() {
  if (drawn_ && is_terminal_) fmt::print(stderr, "\r\033[K");
}

/// Of so many, with a share of the next.
double Progress::workOf(double done) const {
  if (work_.empty()) return done;
  double work = 0.0;
  for (const double one : work_) {
    work += std::clamp(done, 0.0, 1.0) * one;
    done -= 1.0;
  }
  return work;
}

std::string Progress::line(double done, std::string_view extra) {
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
  std::string text = fmt::format("{} {}", what_, std::floor(done));
  if (total_ > 0) {
    const double total = static_cast<double>(total_), share = std::min(done / total, 1.0);
    const auto filled = static_cast<int>(kBarWidth * share);
    pace_.at(seconds, workOf(done));
    const auto left = pace_.left(std::max(0.0, workOf(total) - workOf(done)));
    text = fmt::format("{} [{:#<{}}{:.<{}}] {}/{}{}", what_, "", filled, "", kBarWidth - filled,
                       std::floor(done), total_, left ? fmt::format(", {} left", timeLeft(*left)) : "");
  }
  return extra.empty() ? text : fmt::format("{}, {}", text, extra);
}

void Progress::show(std::uint64_t done, double share_of_next, std::string_view extra) {
  const auto now = std::chrono::steady_clock::now();
  const double all = static_cast<double>(done) + share_of_next;
  if (!is_terminal_) {
    if (log_every_.count() == 0 || now - drawn_at_ < log_every_) return;
    drawn_at_ = now;
    fmt::print(stderr, "{}\n", line(all, extra));
    return;
  }
  if (drawn_ && now - drawn_at_ < std::chrono::milliseconds{100} && done != total_) return;
  drawn_ = true;
  drawn_at_ = now;
  fmt::print(stderr, "\r\033[K{}", line(all, extra));
  std::fflush(stderr);
}

void flushOutput() {
  if (std::fflush(stdout) != 0) throw std::system_error{errno, std::generic_category(), "standard output"};
}

void catchInterrupts() {
  struct sigaction action {};
  action.sa_handler = [](int) { g_interrupted = true; };
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() { return g_interrupted; }

}  // namespace toftwin::cli
