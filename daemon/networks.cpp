// SPDX-License-Identifier: Apache-2.0
#include "daemon/networks.h"

#include <boost/asio/ip/address.hpp>

#include <fmt/format.h>

#include <algorithm>

namespace toftwin::daemon {
namespace {

namespace ip = boost::asio::ip;
using boost::system::error_code;

bool isIn(const ip::network_v4& network, const ip::address_v4& address) {
  return ip::network_v4{address, network.prefix_length()}.canonical() == network;
}

bool isIn(const ip::network_v6& network, const ip::address_v6& address) {
  return ip::network_v6{address, network.prefix_length()}.canonical() == network;
}

}  // namespace

Result<Networks> Networks::read(const std::vector<std::string>& texts) {
  Networks networks;
  for (const std::string& text : texts) {
    error_code is_none;
    const bool is_address = text.find('/') == std::string::npos;
    const bool is_v6 = text.find(':') != std::string::npos;
    if (is_v6) {
      networks.all_.emplace_back(ip::make_network_v6(is_address ? text + "/128" : text, is_none).canonical());
    } else {
      networks.all_.emplace_back(ip::make_network_v4(is_address ? text + "/32" : text, is_none).canonical());
    }
    if (is_none) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("has \"{}\", which is no address or network, such as 10.0.0.0/24 or 192.168.1.7", text)};
    }
  }
  return networks;
}

bool Networks::admit(const ip::address& address) const {
  if (all_.empty() || address.is_loopback()) return true;
  // A socket for both sees IPv4 as a part of IPv6.
  const bool is_mapped = address.is_v6() && address.to_v6().is_v4_mapped();
  const ip::address plain = is_mapped ? ip::make_address_v4(ip::v4_mapped, address.to_v6()) : address;
  return std::ranges::any_of(all_, [&](const auto& one) {
    if (const auto* v4 = std::get_if<ip::network_v4>(&one)) return plain.is_v4() && isIn(*v4, plain.to_v4());
    return plain.is_v6() && isIn(std::get<ip::network_v6>(one), plain.to_v6());
  });
}

}  // namespace toftwin::daemon
