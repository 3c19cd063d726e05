// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/network_v4.hpp>
#include <boost/asio/ip/network_v6.hpp>

#include <string>
#include <variant>
#include <vector>

#include <toftwin/result.h>

namespace toftwin::daemon {

/// Whose connections are taken: "10.0.0.0/24", "192.168.1.7", "fd00::/8". None named: everybody's.
class Networks {
 public:
  Networks() = default;
  /// Error InvalidArgument: a text that is no address or network.
  static Result<Networks> read(const std::vector<std::string>& texts);
  /// This machine is always admitted.
  [[nodiscard]] bool admit(const boost::asio::ip::address& address) const;

 private:
  std::vector<std::variant<boost::asio::ip::network_v4, boost::asio::ip::network_v6>> all_;
};

}  // namespace toftwin::daemon
