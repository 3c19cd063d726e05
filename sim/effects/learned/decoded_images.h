// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/image.h>

namespace toftwin::sim {

/// What a correction takes and gives.
struct DecodedImages {
  Image<float> range_m;    ///< NaN where there is none, which stays
  Image<float> amplitude;  ///< electrons, or empty where nobody knows
};

}  // namespace toftwin::sim
