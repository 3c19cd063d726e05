// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <toftwin/frame.h>

#include "drivers/o3d303/rpc.h"

namespace toftwin::drivers::o3d303 {

/// What the camera says of itself when it is asked, in contrast to what each frame says.
struct Health {
  std::vector<NamedTemperature> temperatures;  ///< "housing", "processor"
  std::optional<Duration> since_power_on;
  SteadyTime asked_at{};
};

/// Also shows whether the camera is alive.
Result<Health> askHealth(Rpc& rpc, const std::stop_token& stop);

}  // namespace toftwin::drivers::o3d303
