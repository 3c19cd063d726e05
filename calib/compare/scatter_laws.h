// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <toftwin/units.h>

namespace toftwin::compare {

/// A camera of the lens-scatter runs. `modulation`: frequencies and their weights in the decoded
/// range; empty for a pulsed camera.
struct ScatterCamera {
  std::string name, title;
  std::vector<std::pair<Frequency, double>> modulation;
  std::vector<int> runs;
};
std::vector<ScatterCamera> scatterCameras();

/// Range error of a surface at `background_mm` to whose light that of a surface at `plate_mm` is
/// added with `eta` times its strength: phasors for a modulated camera, charge for a pulsed one.
/// [mm]
double veilError_mm(const ScatterCamera& camera, double eta, double background_mm, double plate_mm);

}  // namespace toftwin::compare
