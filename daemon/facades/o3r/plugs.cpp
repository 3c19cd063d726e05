// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/o3r/plugs.h"

#include <fmt/format.h>

#include <string_view>

namespace toftwin::daemon::o3r {

Result<std::vector<Plug>> plugsOf(const std::vector<std::string>& ports, const std::string& source) {
  constexpr std::size_t kPorts = 6;
  constexpr int kUsual3d = 2;
  constexpr std::string_view k2d = "/2D";
  if (ports.empty()) return std::vector<Plug>{{.port = kUsual3d, .source = source}};
  if (ports.size() > kPorts) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("has {} entries, but the unit has {} ports, port0 to port5", ports.size(), kPorts)};
  }
  std::vector<Plug> plugs;
  for (std::size_t i = 0; i < ports.size(); ++i) {
    if (ports[i].empty()) continue;
    const bool is_2d = ports[i].ends_with(k2d);
    plugs.push_back({.port = static_cast<int>(i),
                     .source = ports[i].substr(0, ports[i].size() - (is_2d ? k2d.size() : 0)),
                     .is_3d = !is_2d});
  }
  if (plugs.empty())
    return Error{Error::Code::InvalidArgument, "plugs nothing in; name the source of a port"};
  return plugs;
}

}  // namespace toftwin::daemon::o3r
