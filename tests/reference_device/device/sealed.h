// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include <toftwin/result.h>

#include "tests/reference_device/device/hidden.h"

namespace toftwin::reference {

/// How well the rig knows what it does; drawn anew for each capture.
struct Rig {
  double position_mm = 1.0, rotation_deg = 0.1, gain = 0.01;
  template <class Visitor>
  void visit(Visitor& v) {
    v.number("position_mm", position_mm, {0.0, 1000.0}, "standard deviation along each axis");
    v.number("rotation_deg", rotation_deg, {0.0, 10.0}, "about each axis");
    v.number("gain", gain, {0.0, 0.5}, "of the light's power");
  }
};

/// What a sealed specification says.
struct Sealed {
  Rig rig{};
  std::vector<std::unique_ptr<Hidden>> hidden;
  bool changes_each_frame = false;  ///< beyond noise
};

/// `scale` multiplies all strengths. Errors name file, line and key. An empty path: nothing is hidden.
Result<Sealed> readSealed(const std::filesystem::path& file, double scale = 1.0);

}  // namespace toftwin::reference
