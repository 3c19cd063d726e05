// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <toftwin/units.h>

namespace toftwin::compare {

/// A camera of the lens-scatter runs, by its preset's name. `modulation`: frequencies and their weights in
/// the decoded range, empty for a pulsed camera. `runs` show a plate before the background.
struct ScatterCamera {
  std::string name, title;
  std::vector<std::pair<Frequency, double>> modulation;
  std::vector<int> runs;
};
std::vector<ScatterCamera> scatterCameras();

}  // namespace toftwin::compare
