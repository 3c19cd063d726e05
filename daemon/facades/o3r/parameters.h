// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/parameter.h>

#include "daemon/facades/o3r/configuration.h"
#include "daemon/facades/source_changes.h"

namespace toftwin::daemon::o3r {

/// What of a unit never changes.
struct Identity {
  std::string name, address, serial;
  std::array<std::string, 2> macs;
  int diagnostic_port = 0;
};
/// What is plugged in at a port.
struct PortIdentity {
  int number = 0;
  bool is_3d = true;
  int pcic_port = 0;
  std::string serial{};
};
/// What the source at a port is now.
struct PortFacts {
  std::vector<Parameter> parameters{};
  CameraInfo camera{};
};

std::string portPointer(int number);
/// The tree of a unit without heads, and what a head adds to it.
void addUnit(Configuration& configuration, const Identity& identity);
void addPort(Configuration& configuration, const PortIdentity& port);
/// What the source has now is what is shown, with its bounds. At the first time it is also what a reset
/// makes.
void showSource(Configuration& configuration, const PortIdentity& port, const PortFacts& facts,
                double electrons_per_count, bool is_first);
/// What those changes are of a source: its parameters and their values. InvalidArgument: they cannot be
/// together.
Result<SourceChanges> sourceChangesOf(const Configuration& configuration,
                                      const Configuration::Changes& changes, const PortIdentity& port,
                                      const PortFacts& facts, double electrons_per_count);

}  // namespace toftwin::daemon::o3r
