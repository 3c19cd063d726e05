// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <toftwin/fields.h>
#include <toftwin/result.h>
#include <toftwin/units.h>

#include "daemon/facades/timing/unevenness.h"

/// A plug-in for OpenNI2: in any program that uses that library, the sources of a daemon are devices. It is a
/// client of the native protocol inside that program.
namespace toftwin::openni2 {

/// The keys of the plug-in's file.
struct Keys {
  std::vector<std::string> addresses;
  Length max_depth = 10_m;
  double amplitude_per_count = 1.0;
  bool mirror = false;
  std::string intervals;
  Duration latency = 0_s;

  template <class Visitor>
  void visit(Visitor& v) {
    v.texts("addresses", addresses,
            "of the daemons whose sources are devices, as \"tcp:host:port\" or \"unix:/path\"; none: the one on "
            "this machine, at its usual places");
    v.quantity("max_depth", max_depth, metre, {0.1, 65.5},
               "depth from there on is 0 in the image; many programs have tables of 10,000 entries, for 10 m");
    v.number("amplitude_per_count", amplitude_per_count, {1e-6, 1e9},
             "what one count of the infrared image stands for in the source's unit");
    v.flag("mirror", mirror, "whether images begin mirrored, as those of PrimeSense's cameras do");
    v.text("intervals", intervals,
           "a file with the intervals between a real camera's frames, one number in milliseconds per line, "
           "relative to this file: frames come as unevenly as those; empty: as they come");
    v.quantity("latency", latency, millisecond, {0.0, 10'000.0},
               "by how much later than the source's every frame comes, as if the camera had taken that long");
  }
};

struct Configuration {
  Keys keys;
  daemon::Unevenness unevenness;  ///< of the key `intervals`
  bool is_off = false;  ///< no device is shown

  /// Where sources are whose URI names no daemon.
  [[nodiscard]] std::string firstAddress() const {
    return keys.addresses.empty() ? std::string{} : keys.addresses.front();
  }
};

/// From a file, or the defaults if its name is empty. `where` stands over the file's addresses unless it is
/// empty: "off", or addresses with commas between.
Result<Configuration> readConfiguration(const std::string& file, std::string_view where);

/// By the environment (docs/facades/openni2.md).
Result<Configuration> configurationHere();

}  // namespace toftwin::openni2
