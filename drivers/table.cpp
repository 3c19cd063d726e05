// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "drivers/o3d303/o3d303.h"
#include "drivers/pattern/pattern.h"
#include "drivers/replay/replay.h"
#include "drivers/sim/simulator.h"
#include "drivers/source.h"

namespace toftwin::drivers {

std::span<const Driver> allDrivers() {
  // One line per driver, in the order of docs/drivers/README.md.
  static const std::array rows{
      pattern::row(),
      replay::row(),
      simulator::row(),
      o3d303::row(),
  };
  return rows;
}

}  // namespace toftwin::drivers
