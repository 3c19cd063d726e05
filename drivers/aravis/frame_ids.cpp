// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/frame_ids.h"

#include <algorithm>
#include <chrono>

namespace toftwin::drivers::aravis {
namespace {

/// Where nobody knows the rate: faster than any camera that this is for.
constexpr double kUnknown_s = 1e-3;
/// Cameras' intervals vary.
constexpr double kMargin = 1.25;
/// How much longer than its arrival says a frame may have been taken after the last one, which came late.
constexpr double kLatest_s = 1.0;
/// Of numbers with 16 bits.
constexpr std::uint64_t kMostShort = 65'535;

double elapsed_s(const FrameIds::Seen& from, const FrameIds::Seen& to) {
  const double arrived_s = std::chrono::duration<double>{to.arrived - from.arrived}.count();
  const double taken_s = static_cast<double>(to.taken.ns - from.taken.ns) * 1e-9;
  return std::max({0.0, arrived_s, std::min(taken_s, arrived_s + kLatest_s)});
}

/// How many numbers further; 0 if it is not further. Numbers of 16 bits wrap around from 65535 to 1, because
/// 0 is none.
std::uint64_t stepsBetween(std::uint64_t from, std::uint64_t to) {
  if (to > from) return to - from;
  const bool has_wrapped = from <= kMostShort && from - to > kMostShort / 2;
  return has_wrapped ? to + kMostShort - from : 0;
}

}  // namespace

void FrameIds::setInterval(std::optional<Duration> interval) {
  said_s_ = interval ? interval->in(second) : kUnknown_s;
  interval_s_ = said_s_;
}

void FrameIds::restart() {
  last_.reset();
  doubted_.reset();
  doubts_ = told_ = 0;
}

std::uint64_t FrameIds::lostBefore(const Seen& now, std::uint64_t bad) {
  if (!last_) return adopt(now), bad;
  if (const std::uint64_t steps = believed(*last_, now); steps > 0) {
    if (steps == 1) learn(elapsed_s(*last_, now));
    const std::uint64_t between = steps - 1, known = doubts_ + told_;
    adopt(now);
    return std::max(bad, between > known ? between - known : 0);
  }
  if (const std::uint64_t steps = doubted_ ? believed(*doubted_, now) : 0; steps > 0) {
    adopt(now);
    return std::max(bad, steps - 1);
  }
  doubted_ = now;
  ++doubts_;
  told_ += bad;
  return bad;
}

/// How many numbers further it is; 0 if that is not believed.
std::uint64_t FrameIds::believed(const Seen& from, const Seen& to) const {
  const std::uint64_t steps = stepsBetween(from.id, to.id);
  return static_cast<double>(steps) <= 1.0 + kMargin * elapsed_s(from, to) / interval_s_ ? steps : 0;
}

/// Some cameras take frames faster than they say.
void FrameIds::learn(double step_s) {
  constexpr double kShare = 0.125;
  interval_s_ += kShare * (std::min(step_s, said_s_) - interval_s_);
  interval_s_ = std::max(interval_s_, std::min(said_s_, kUnknown_s));
}

void FrameIds::adopt(const Seen& now) {
  last_ = now;
  doubted_.reset();
  doubts_ = told_ = 0;
}

}  // namespace toftwin::drivers::aravis
