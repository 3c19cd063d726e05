// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "calib/discover/campaign/captures/campaign.h"

namespace toftwin::discover {

/// Before a temperature's place: "temperature_rate_sensor".
inline constexpr std::string_view kRatePrefix = "temperature_rate_";

struct TemperatureRate {
  std::string covariate{};
  double c_per_min = 0.0;  ///< NaN: too few captures say it
};

/// How fast a camera's temperatures change at each capture, but the room's: the slope of a parabola through the
/// captures about it, five or all within a minute, by their own times since power-on.
std::vector<std::vector<TemperatureRate>> temperatureRates(const std::vector<MeasuredCapture>& captures);

}  // namespace toftwin::discover
