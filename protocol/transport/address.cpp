// SPDX-License-Identifier: Apache-2.0
#include "protocol/transport/address.h"

#include <charconv>
#include <optional>

namespace toftwin::transport {
namespace {

constexpr std::size_t kMaxUnixPath = 107;  // sockaddr_un::sun_path less its closing zero

Error invalid(std::string_view address, const std::string& what) {
  return {Error::Code::InvalidArgument,
          "address \"" + std::string{address} + "\": " + what +
              "; write \"tcp:host:port\", \"host:port\", \"tls:host:port\" or \"unix:/path\""};
}

std::optional<std::uint16_t> toPort(std::string_view digits) {
  std::uint16_t port = 0;
  const auto [end, fault] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
  if (fault != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
  return port;
}

Result<Address> parseUnix(std::string_view whole, std::string_view path) {
  if (path.empty()) return invalid(whole, "the path is missing");
  if (path.size() > kMaxUnixPath) {
    return invalid(whole, "the path has " + std::to_string(path.size()) +
                              " bytes, a Unix socket's has at most 107");
  }
  return Address{UnixAddress{std::string{path}}};
}

Result<Address> parseTcp(std::string_view whole, std::string_view text,
                         std::uint16_t default_port) {
  std::string_view host = text, digits;
  if (text.starts_with('[')) {  // an IPv6 address has colons of its own
    const auto close = text.find(']');
    if (close == std::string_view::npos) return invalid(whole, "the closing ] is missing");
    host = text.substr(1, close - 1);
    digits = text.substr(close + 1);
    if (!digits.empty() && digits[0] != ':') return invalid(whole, "what follows ] is not a port");
  } else if (const auto colon = text.find(':'); colon != std::string_view::npos) {
    host = text.substr(0, colon);
    digits = text.substr(colon);
    if (digits.find(':', 1) != std::string_view::npos) {
      return invalid(whole, "an IPv6 address goes in brackets, like [::1]:47800");
    }
  }
  if (host.empty()) return invalid(whole, "the host is missing");
  if (digits.empty()) return Address{TcpAddress{std::string{host}, default_port}};
  const auto port = toPort(digits.substr(1));
  if (!port) return invalid(whole, "the port is not a number from 0 to 65535");
  return Address{TcpAddress{std::string{host}, *port}};
}

}  // namespace

Result<Address> parseAddress(std::string_view text, std::uint16_t default_port) {
  if (text.starts_with("unix:")) return parseUnix(text, text.substr(5));
  if (text.starts_with("tls:")) {
    auto address = parseTcp(text, text.substr(4), default_port);
    if (address) std::get<TcpAddress>(*address).is_encrypted = true;
    return address;
  }
  if (text.starts_with("tcp:")) return parseTcp(text, text.substr(4), default_port);
  return parseTcp(text, text, default_port);
}

std::string toString(const Address& address) {
  if (const auto* local = std::get_if<UnixAddress>(&address)) return "unix:" + local->path;
  const auto& tcp = std::get<TcpAddress>(address);
  const bool is_ipv6 = tcp.host.find(':') != std::string::npos;
  return (tcp.is_encrypted ? "tls:" : "tcp:") + (is_ipv6 ? "[" + tcp.host + "]" : tcp.host) + ":" + std::to_string(tcp.port);
}

}  // namespace toftwin::transport
