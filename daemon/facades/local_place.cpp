// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/local_place.h"

#include <ifaddrs.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace toftwin::daemon {

using boost::asio::ip::address_v4;

LocalPlace placeOf(address_v4 address) {
  constexpr std::uint32_t kLoopback = 0xFF00'0000, kSmall = 0xFFFF'FF00;
  LocalPlace place{address, address.is_loopback() ? kLoopback : kSmall};
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return place;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_netmask == nullptr || one->ifa_addr->sa_family != AF_INET)
      continue;
    const auto addressOf = [](const sockaddr* of) {
      return ntohl(reinterpret_cast<const sockaddr_in*>(of)->sin_addr.s_addr);
    };
    // All of 127/8 is the loopback interface's, whatever address of it that names.
    const std::uint32_t own = addressOf(one->ifa_addr);
    if (address.is_loopback() ? !address_v4{own}.is_loopback() : own != address.to_uint()) continue;
    if (!address.is_loopback()) place.netmask = addressOf(one->ifa_netmask);
    const std::string name = one->ifa_name;
    place.interface_name = name.substr(0, name.find(':'));  // an address may have a label
  }
  ::freeifaddrs(all);
  return place;
}

}  // namespace toftwin::daemon
