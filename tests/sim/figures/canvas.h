// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <toftwin/image.h>

#include "calib/compare/plot.h"

namespace toftwin::sim::figures {

/// A plot as an SVG file of its own: light page, legend below, no style sheet needed.
std::string standalone(const compare::Plot& plot);

/// An image in a row of images that share their scale. Pixels become squares; NaN is hatched.
struct Panel {
  std::string title;
  Image<float> values;
};
struct Panels {
  std::string label;  ///< of the scale, with its unit
  double low = 0.0, high = 1.0;
  bool diverging = false;  ///< blue below the middle, red above; else dark to bright
  std::vector<Panel> panels;
};
std::string standalone(const Panels& panels);

}  // namespace toftwin::sim::figures
