// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/hidden.h"

#include <array>

#include "tests/reference_device/device/effects/effects.h"

namespace toftwin::reference {

std::span<const Row> allHidden() {
  // One line per effect, in the order of docs/reference-device.md.
  static const std::array rows{
      exposureDelay(),      frameParity(),    incidenceDelay(),    temperatureRate(),
      ambientRange(),       columnDelay(),    thermalLens(),       dust(),
      overexposedScatter(), supplySag(),      firmwareFilter(),    tableSteps(),
      interferenceBurst(),  halfStep(),       albedoDelay(),       amplitudeStep(),
      radiusWiggle(),       lampFlicker(),    exposureWindow(),    railScale(),
      rayOffset(),          warmUp(),         clockScale(),        scatter(),
      tapOffset(),          spreadSpectrum(), coarseThermometer(), rollingStart(),
      supplyBeat(),         rowCrosstalk(),   resetGlow(),         modeHop(),
      glossyPaint(),
  };
  return rows;
}

std::string documentHidden() {
  const auto wordOf = [](Stage stage) {
    return stage == Stage::Light ? "light" : stage == Stage::Samples ? "samples" : "range";
  };
  std::string text =
      "| effect | what it does | acts on | strength | goes with |\n| --- | --- | --- | --- | --- |\n";
  for (const auto& [about, read] : allHidden()) {
    text += "| `" + std::string{about.name} + "` | " + std::string{about.summary};
    if (!about.catalogue.empty()) text += " (the catalogue's `" + std::string{about.catalogue} + "`)";
    text += std::string{" | "} + wordOf(about.stage) + " | " + std::string{about.unit} + " | " +
            std::string{about.covariates} + " |\n";
  }
  return text;
}

}  // namespace toftwin::reference
