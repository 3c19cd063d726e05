// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/result.h>

#include <sys/types.h>

#include <set>
#include <utility>

/// Cyclone DDS opens the sockets on which it receives for all networks of the machine, whatever interface it
/// is told to use. These functions close the others.
namespace toftwin::daemon::ros2 {

/// File descriptors and inodes.
using Sockets = std::set<std::pair<int, ino_t>>;

/// This process' UDP sockets on a port of that DDS domain that hear every network.
Sockets openSockets(int domain);

/// Lets those that are new since `before` hear the interface lo alone. Internal: the kernel refuses, or there
/// is none; then the caller must close them.
Result<> confineNewSockets(int domain, const Sockets& before);

}  // namespace toftwin::daemon::ros2
