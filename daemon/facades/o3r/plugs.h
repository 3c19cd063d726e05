// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::daemon::o3r {

/// What is plugged in at one of the unit's ports.
struct Plug {
  int port = 0;
  std::string source;
  bool is_3d = true;
  bool operator==(const Plug&) const = default;
};

/// Of the key `ports`: for each port in turn NAME, NAME/2D, or nothing. `source` at port2 where the key is
/// empty. InvalidArgument: more ports than there are, or nothing is plugged in.
Result<std::vector<Plug>> plugsOf(const std::vector<std::string>& ports, const std::string& source);

}  // namespace toftwin::daemon::o3r
