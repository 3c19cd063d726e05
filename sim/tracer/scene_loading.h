// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stop_token>

namespace toftwin::sim {

/// How a scene is loaded.
struct SceneLoading {
  std::stop_token stop;      ///< ends it soon, with the error Stopped
  bool may_convert = false;  ///< of mesh files: ReadOptions::may_convert
};

}  // namespace toftwin::sim
