// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace toftwin::daemon {

/// Notes SIGHUP, SIGTERM and SIGINT from its construction on, while the daemon starts: reading the
/// configuration opens cameras, which may take its time. Whoever handles signals later takes their place. A
/// second SIGTERM or SIGINT ends the process, should a driver be stuck. One at a time.
class StartSignals {
 public:
  StartSignals();
  [[nodiscard]] static bool isReloadWanted();
  [[nodiscard]] static bool isStopWanted();
};

}  // namespace toftwin::daemon
