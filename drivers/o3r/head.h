// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include <toftwin/result.h>

namespace toftwin::drivers::o3r {

/// What the unit's configuration says of a head, as far as we use it.
struct Head {
  std::string type, part_number, serial, state;
  int pcic_port = 0;
  std::map<std::string, double, std::less<>> acquisition;  ///< exposureLong, framerate, …
};
/// The head at that port in a part of the configuration, as the unit answers it. Any text is safe. NotFound:
/// it is not there; Incompatible: it is no 3D head.
Result<Head> readHead(std::string_view json, const std::string& port);
/// What sets it: the part of the configuration that differs from what it is. Empty: nothing does.
std::string settingsFor(const Head& head, const std::string& port,
                        const std::map<std::string, double, std::less<>>& wanted);

/// o3r:ADDRESS[:PORT][/portN].
struct HeadAddress {
  std::string host;
  std::uint16_t xmlrpc_port = 80;
  std::string port = "port2";
  bool operator==(const HeadAddress&) const = default;
};
/// NotFound: it is none.
Result<HeadAddress> readAddress(std::string_view uri);

}  // namespace toftwin::drivers::o3r
