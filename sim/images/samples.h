// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <toftwin/image.h>
#include <toftwin/units.h>

namespace toftwin::sim {

/// Correlation samples in electrons: `electrons[f * steps + k]` is frequency f at step k, taken with
/// the reference delayed by 2πk/steps.
struct Samples {
  std::vector<Frequency> frequencies;
  int steps = 4;
  std::vector<Image<float>> electrons;
};

}  // namespace toftwin::sim
