// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include <toftwin/frame.h>

namespace toftwin::sim {

/// The moment's temperature of that name; where the camera does not tell it, the first one it tells.
inline std::optional<Temperature> temperatureOf(const Moment& moment, std::string_view name) {
  for (const NamedTemperature& named : moment.temperatures) {
    if (named.where == name) return named.value;
  }
  if (moment.temperatures.empty()) return std::nullopt;
  return moment.temperatures.front().value;
}

/// How many degrees it is warmer than `reference`; 0 where nobody knows.
inline double degreesAbove(Temperature reference, const Moment& moment, std::string_view name) {
  const auto temperature = temperatureOf(moment, name);
  return temperature ? (*temperature - reference).in(celsius) : 0.0;
}

}  // namespace toftwin::sim
