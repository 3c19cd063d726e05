// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <toftwin/parameter.h>
#include <toftwin/result.h>

#include "drivers/v4l2/device.h"

namespace toftwin::drivers::v4l2 {

/// A control of a node as a parameter: value = code × unit.
struct Control {
  std::uint32_t id = 0;
  std::string name;
  std::int64_t min = 0, max = 0, step = 1;
  std::int64_t unit = 1;
  bool is_menu = false;
  std::vector<std::int64_t> menu{};  ///< the choices there are, if it is one
};

/// Whole-number controls that can be read and written, by the kernel's order. Those of single
/// drivers (test injections, codecs) are left to the tools made for them.
std::vector<Control> controlsOf(const Device& device);
/// Without a value where the camera changes it by itself, or takes none at present.
Parameter stateOf(const Device& device, const Control& control);
Result<> set(const Device& device, const Control& control, double value);

}  // namespace toftwin::drivers::v4l2
