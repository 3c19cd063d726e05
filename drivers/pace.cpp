// SPDX-License-Identifier: Apache-2.0
#include "drivers/pace.h"

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <mutex>

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
  since_.reset();  // what was not paced is not caught up with
  triggers_ = 0;
}

void Pacer::restart() {
  since_.reset();
  triggers_ = 0;
}

Result<std::uint64_t> Pacer::waitForTurn(const std::stop_token& stop, bool lockstep) {
  const Error stopped{Error::Code::Stopped, "asked to stop"};
  if (stop.stop_requested()) return stopped;
  if (lockstep || pace_ == Pace::Fast) {
    since_.reset();
    clock_ = {};  // device time no longer runs with the host's
    return std::uint64_t{0};
  }
  const SteadyTime now = std::chrono::steady_clock::now();
  if (pace_ == Pace::Trigger) {
    if (triggers_ > 0) return --triggers_, std::uint64_t{0};
    if (!sleepUntil(now + kLongestWait, stop)) return stopped;
    return Error{Error::Code::Timeout, "no trigger within a second"};
  }
  if (!since_) {
    since_ = now - nanoseconds{deviceTime().ns};
    clock_ = relateToHost(deviceTime(), now);
  }
  const SteadyTime due = *since_ + nanoseconds{deviceTime().ns};
  if (now > due) {
    const auto lost = static_cast<std::uint64_t>((now - due).count() / interval_ns_);
    index_ += lost;
    return lost;
  }
  if (!sleepUntil(std::min(due, now + kLongestWait), stop)) return stopped;
  if (due - now > kLongestWait) return Error{Error::Code::Timeout, "not yet"};
  return std::uint64_t{0};
}

}  // namespace toftwin::drivers
