// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <toftwin/fields.h>

namespace toftwin {

/// A number of a camera that can be set while it runs. Its name ends in its unit.
struct Parameter {
  std::string name;
  std::optional<double> value{};  ///< as it is now; nothing if the camera cannot tell
  Bounds bounds{};                ///< infinite where they are not known
};

}  // namespace toftwin
