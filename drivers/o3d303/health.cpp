// SPDX-License-Identifier: Apache-2.0
#include "drivers/o3d303/health.h"

#include <charconv>
#include <chrono>

namespace toftwin::drivers::o3d303 {
namespace {

constexpr double kNoSensor_c = 3276.0;  // the camera says 3276.7 where there is none
constexpr double kSecondsPerHour = 3600.0;

std::optional<double> numberIn(const std::string& text) {
  double number = 0.0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  if (read.ec != std::errc{}) return std::nullopt;
  return number;
}

}  // namespace

Result<Health> askHealth(Rpc& rpc, const std::stop_token& stop) {
  const auto all = rpc.call("", "getAllParameters", {}, stop);
  if (!all) return all.error();
  Health health;
  for (const auto& [name, where] :
       {std::pair{"TemperatureFront1", "housing"}, {"TemperatureIMX6", "processor"}}) {
    const auto value_c = numberIn(all->textAt(name));
    if (value_c && *value_c > -273.15 && *value_c < kNoSensor_c) {
      health.temperatures.push_back({where, *value_c * celsius});
    }
  }
  if (const auto hours = numberIn(all->textAt("UpTime")); hours && *hours >= 0.0) {
    health.since_power_on = *hours * kSecondsPerHour * second;
  }
  health.asked_at = std::chrono::steady_clock::now();
  return health;
}

}  // namespace toftwin::drivers::o3d303
