// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

#include <toftwin/result.h>

namespace toftwin::transport {

struct TcpAddress {
  std::string host;
  std::uint16_t port = 0;
  bool is_encrypted = false;  ///< by TLS
  bool operator==(const TcpAddress&) const = default;
};
struct UnixAddress {
  std::string path;
  bool operator==(const UnixAddress&) const = default;
};
using Address = std::variant<TcpAddress, UnixAddress>;

/// Reads "tls:host:port", "tcp:host:port", "host:port", "[::1]:port" (each with or without ":port", then it is
/// `default_port`) or "unix:/path".
Result<Address> parseAddress(std::string_view text, std::uint16_t default_port);
/// The address as `parseAddress` reads it.
std::string toString(const Address& address);

}  // namespace toftwin::transport
