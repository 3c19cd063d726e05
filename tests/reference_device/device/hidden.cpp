// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/hidden.h"

#include <array>

#include "tests/reference_device/device/effects/effects.h"

namespace toftwin::reference {

std::span<const Row> allHidden() {
  // One line per effect, in the order of docs/reference-device.md.
  static const std::array rows{
      exposureDelay(),      frameParity(), incidenceDelay(), temperatureRate(),
      ambientRange(),       columnDelay(), thermalLens(),    dust(),
      overexposedScatter(), supplySag(),   firmwareFilter(), tableSteps(),
      interferenceBurst(),  halfStep(),    albedoDelay(),    amplitudeStep(),
      radiusWiggle(),       lampFlicker(), exposureWindow(), railScale(),
      rayOffset(),          warmUp(),      clockScale(),     scatter(),
      tapOffset(),
  };
  return rows;
}

}  // namespace toftwin::reference
