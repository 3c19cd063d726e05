// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "tests/reference_device/device/hidden.h"

/// One function for each hidden effect; its file says the rest.
namespace toftwin::reference {

Row exposureDelay();
Row frameParity();
Row incidenceDelay();
Row temperatureRate();
Row ambientRange();
Row columnDelay();
Row thermalLens();
Row dust();
Row overexposedScatter();
Row supplySag();
Row firmwareFilter();
Row tableSteps();
Row interferenceBurst();
Row halfStep();
Row albedoDelay();
Row amplitudeStep();
Row radiusWiggle();
Row lampFlicker();
Row exposureWindow();
Row railScale();
Row rayOffset();
Row warmUp();
Row clockScale();
Row scatter();
Row tapOffset();
Row spreadSpectrum();
Row coarseThermometer();
Row rollingStart();
Row supplyBeat();
Row rowCrosstalk();
Row resetGlow();
Row modeHop();
Row glossyPaint();

/// Of a pixel's distance from the image's middle, 1 in the corners.
inline double squareOfRadius(const Light& light, std::size_t pixel) {
  const auto width = static_cast<std::size_t>(light.width);
  const double x = static_cast<double>(pixel % width) - (light.width - 1) / 2.0;
  const double y = static_cast<double>(pixel / width) - (light.height - 1) / 2.0;
  const double cx = (light.width - 1) / 2.0, cy = (light.height - 1) / 2.0;
  return (x * x + y * y) / (cx * cx + cy * cy);
}

}  // namespace toftwin::reference
