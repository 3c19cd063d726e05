// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/cli/options.h"

namespace toftwin::cli {

/// What one check found. `mend` is the command or the action that helps, empty where all is well.
struct Finding {
  enum class State { Good, Warning, Bad };
  State state = State::Good;
  std::string check;
  std::string found;
  std::string mend;
};

/// All checks, in the order in which one thing needs the other.
std::vector<Finding> examine(const DaemonOptions& daemon, const std::filesystem::path& folder);

// Each check alone, for the tests.
Finding checkLocale(const char* locale);
Finding checkSocket(const std::string& path);
Finding checkPort(std::uint16_t port);
Finding checkFolder(const std::filesystem::path& folder);
/// The connection, and below it one finding for each source of the daemon.
std::vector<Finding> checkDaemon(const DaemonOptions& daemon);

}  // namespace toftwin::cli
