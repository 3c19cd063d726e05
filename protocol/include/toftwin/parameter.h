// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <toftwin/fields.h>

namespace toftwin {

/// What can be set of a camera while it runs: a number, a text, or one of several choices, which have a
/// number, too, where the camera gives them one. The name of a number ends in its unit.
struct Parameter {
  std::string name;
  std::optional<double> value{};  ///< as it is now; nothing if the camera cannot tell
  Bounds bounds{};                ///< infinite where they are not known
  std::optional<std::string>
      text{};  ///< as it is now; nothing if it is a number alone, or the camera cannot tell
  std::vector<std::string> choices{};  ///< the texts that it takes; empty: any, if it has a text
};

}  // namespace toftwin
