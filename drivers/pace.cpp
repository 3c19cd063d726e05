// SPDX-License-Identifier: Apache-2.0
#include "drivers/pace.h"

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

}  // namespace toftwin::drivers
