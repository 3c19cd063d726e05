// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/ip/address_v4.hpp>

#include <cstdint>
#include <string>

namespace toftwin::daemon {

/// An IPv4 address of this computer and the network behind it.
struct LocalPlace {
  boost::asio::ip::address_v4 address;
  std::uint32_t netmask = 0;
  std::string interface_name{};  ///< empty: not told

  [[nodiscard]] boost::asio::ip::address_v4 broadcast() const {
    return boost::asio::ip::address_v4{address.to_uint() | ~netmask};
  }
};
/// Netmask and interface that has that address; of a small network where that is not told.
LocalPlace placeOf(boost::asio::ip::address_v4 address);

}  // namespace toftwin::daemon
