// SPDX-License-Identifier: Apache-2.0
#include "calib/compare/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace toftwin::compare {
namespace {

std::string duration(double seconds) {
  if (seconds < 1.5) return "about a second";
  if (seconds < 90.0) return fmt::format("about {:.0f} s", seconds);
  return fmt::format("about {:.0f} min", seconds / 60.0);
}

}  // namespace

void Pace::at(double seconds, double done) {
  const double passed_s = std::max(0.0, seconds - last_s_);
  const double kept = std::exp(-passed_s / std::max(5.0, 0.5 * seconds));
  done_ = kept * done_ + std::max(0.0, done - last_done_);
  seconds_ = kept * seconds_ + passed_s;
  last_s_ = std::max(last_s_, seconds);
  last_done_ = std::max(last_done_, done);
}

std::optional<double> Pace::left(double work) const {
  if (work <= 0.0) return 0.0;
  if (!(done_ > 0.0) || !(seconds_ > 0.0)) return std::nullopt;
  return work * seconds_ / done_;
}

double Progress::left(double share) {
  double done = 0.0, all = 0.0;
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    all += steps_[i].second;
    if (i + 1 < next_) done += steps_[i].second;
    if (i + 1 == next_) done += share * steps_[i].second;
  }
  pace_.at(std::chrono::duration<double>(Clock::now() - started_).count(), done);
  return pace_.left(all - done).value_or(all - done);
}

void Progress::line(double share) {
  if (out_ == nullptr) return;
  const std::string text = fmt::format("[{}/{}] {} ({} left)", next_, steps_.size(),
                                       steps_[next_ - 1].first, duration(left(share)));
  on_terminal_ = ::isatty(::fileno(out_)) != 0;
  fmt::print(out_, "{}{}{}", on_terminal_ ? "\r\033[K" : "", text, on_terminal_ ? "" : "\n");
  std::fflush(out_);
  said_ = Clock::now();
}

void Progress::begin() {
  if (next_ == 0) started_ = Clock::now();
  if (next_ >= steps_.size()) return;
  if (on_terminal_ && out_ != nullptr && next_ > 0) fmt::print(out_, "\n");
  ++next_;
  line(0.0);
}

void Progress::at(double share) {
  if (next_ == 0) return;
  // A terminal's line is overwritten and may be lively; a log gets a line every ten seconds.
  const auto quiet =
      on_terminal_ ? std::chrono::milliseconds{200} : std::chrono::milliseconds{10'000};
  if (Clock::now() - said_ >= quiet) line(std::clamp(share, 0.0, 1.0));
}

void Progress::end() {
  if (out_ == nullptr) return;
  if (on_terminal_) fmt::print(out_, "\n");
  const double passed = std::chrono::duration<double>(Clock::now() - started_).count();
  fmt::print(out_, "done in {}\n",
             passed < 90.0 ? fmt::format("{:.0f} s", passed) : fmt::format("{:.0f} min", passed / 60.0));
}

}  // namespace toftwin::compare
