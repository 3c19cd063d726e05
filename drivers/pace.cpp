// SPDX-License-Identifier: Apache-2.0
#include "drivers/pace.h"

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <utility>

namespace toftwin::drivers {

using std::chrono::duration_cast;
using std::chrono::nanoseconds;

bool sleepUntil(SteadyTime time, const std::stop_token& stop) {
  if (stop.stop_requested()) return false;
  if (time <= std::chrono::steady_clock::now()) return true;
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock{mutex};
  never.wait_until(lock, stop, time, [] { return false; });
  return !stop.stop_requested();
}

ClockRelation relateToHost(DeviceTime device, SteadyTime at) {
  const auto before = std::chrono::steady_clock::now();
  const auto wall = std::chrono::system_clock::now();
  const auto after = std::chrono::steady_clock::now();
  const auto half = (after - before) / 2;
  const nanoseconds since = before + half - at;
  const nanoseconds host = duration_cast<nanoseconds>(wall.time_since_epoch()) - since;
  return {.host_minus_device_ns = host.count() - device.ns,
          .uncertainty_ns = duration_cast<nanoseconds>(half).count()};
}

namespace {

/// A chosen frame that is so late is of no use to anybody.
constexpr std::chrono::seconds kStale{1};

std::int64_t nanosecondsOf(Duration frame_interval) {
  return std::max<std::int64_t>(1, std::llround(frame_interval.in(nanosecond)));
}

}  // namespace

Pacer::Pacer(Pace pace, Duration frame_interval) : pace_(pace), interval_ns_(nanosecondsOf(frame_interval)) {}

void Pacer::setInterval(Duration frame_interval) {
  base_ns_ = deviceTime().ns;
  base_index_ = index_;
  interval_ns_ = nanosecondsOf(frame_interval);
}

void Pacer::setPace(Pace pace) {
  pace_ = pace;
  restart();
}

nanoseconds Pacer::lateness(std::uint64_t index, SteadyTime now) const {
  return duration_cast<nanoseconds>(now - *since_) - nanoseconds{deviceTimeOf(index).ns};
}

std::uint64_t Pacer::turnsLost(std::uint64_t index, SteadyTime now) const {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, lateness(index, now).count() / interval_ns_));
}

DeviceTime Pacer::chooseNext() {
  lost_ = since_ ? turnsLost(index_ + 1, std::chrono::steady_clock::now()) : 0;
  next_ = index_ + 1 + lost_;
  return deviceTimeOf(*next_);
}

void Pacer::advance() {
  is_chosen_ = next_.has_value();
  index_ = next_.value_or(index_ + 1);
  next_.reset();
}

void Pacer::restart() {
  since_.reset();  // what was not paced is not caught up with
  triggers_ = 0;
  next_.reset();
  is_chosen_ = false;
  lost_ = 0;
}

Result<std::uint64_t> Pacer::waitForTurn(const std::stop_token& stop, bool lockstep) {
  const Error stopped{Error::Code::Stopped, "asked to stop"};
  if (stop.stop_requested()) return stopped;
  if (lockstep || pace_ == Pace::Fast) {
    since_.reset();
    clock_ = {};  // device time no longer runs with the host's
    return takeTurn();
  }
  const SteadyTime now = std::chrono::steady_clock::now();
  if (pace_ == Pace::Trigger) {
    if (triggers_ > 0) return --triggers_, takeTurn();
    if (!sleepUntil(now + kLongestWait, stop)) return stopped;
    return Error{Error::Code::Timeout, "no trigger within a second"};
  }
  if (!since_) {
    since_ = now - nanoseconds{deviceTime().ns};
    clock_ = relateToHost(deviceTime(), now);
  }
  const nanoseconds late = lateness(index_, now);
  if (late > nanoseconds{0}) {
    if (!is_chosen_ || late > kStale) {
      const std::uint64_t lost = turnsLost(index_, now);
      index_ += lost;
      lost_ += lost;
    }
    return takeTurn();
  }
  if (!sleepUntil(now + std::min(-late, nanoseconds{kLongestWait}), stop)) return stopped;
  if (-late > kLongestWait) return Error{Error::Code::Timeout, "not yet"};
  return takeTurn();
}

std::uint64_t Pacer::takeTurn() {
  is_chosen_ = false;
  return std::exchange(lost_, 0);
}

}  // namespace toftwin::drivers
