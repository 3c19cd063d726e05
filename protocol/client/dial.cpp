// SPDX-License-Identifier: Apache-2.0
#include "protocol/client/dial.h"

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace toftwin::client {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

Error unreachable(const transport::Address& address, const error_code& fault) {
  const std::string where = "cannot reach toftwind at " + transport::toString(address) + ": ";
  if (fault == asio::error::access_denied) {
    return {Error::Code::PermissionDenied,
            where + fault.message() + ". Join the group that owns the socket, or use TCP"};
  }
  return {Error::Code::Disconnected,
          where + fault.message() +
              ". Is it running? Start it with \"toftwind\", or name the address where it listens"};
}

Error late(const transport::Address& address, std::chrono::milliseconds timeout) {
  return {Error::Code::Timeout, "toftwind at " + transport::toString(address) +
                                    " cannot be reached within " + std::to_string(timeout.count()) +
                                    " ms. Is the address right, does a firewall drop the packets?"};
}

/// Runs `io` until `outcome` is set; false if it is not in time.
bool waitFor(asio::io_context& io, const std::optional<error_code>& outcome,
             std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  io.restart();
  while (!outcome && io.run_one_until(deadline) > 0) {
  }
  return outcome.has_value();
}

Result<transport::Socket> dialUnix(asio::io_context& io, const transport::UnixAddress& address) {
  asio::local::stream_protocol::socket socket{io};
  error_code fault;
  socket.connect({address.path}, fault);  // answers at once: there is no network to wait for
  if (fault) return unreachable(address, fault);
  return transport::Socket{std::move(socket)};
}

/// What "localhost" always means (RFC 6761, 6.3), also where no hosts file says so.
std::array<asio::ip::tcp::endpoint, 2> loopback(std::uint16_t port) {
  return {asio::ip::tcp::endpoint{asio::ip::address_v4::loopback(), port},
          asio::ip::tcp::endpoint{asio::ip::address_v6::loopback(), port}};
}

Result<transport::Socket> dialTcp(asio::io_context& io, const transport::TcpAddress& address,
                                  std::chrono::milliseconds timeout) {
  std::optional<error_code> outcome;
  asio::ip::tcp::socket socket{io};
  asio::ip::tcp::resolver resolver{io};
  const auto connect = [&](const auto& endpoints) {
    asio::async_connect(socket, endpoints,
                        [&](error_code result, const asio::ip::tcp::endpoint&) { outcome = result; });
  };
  resolver.async_resolve(address.host, std::to_string(address.port),
                         [&](error_code fault, const asio::ip::tcp::resolver::results_type& endpoints) {
                           if (!fault) {
                             connect(endpoints);
                           } else if (address.host == "localhost") {
                             connect(loopback(address.port));
                           } else {
                             outcome = fault;
                           }
                         });
  const bool in_time = waitFor(io, outcome, timeout);
  if (!in_time) {  // the handlers refer to this function's variables: let them finish
    resolver.cancel();
    error_code ignored;
    socket.close(ignored);
    io.restart();
    io.run();
    return late(address, timeout);
  }
  if (*outcome) return unreachable(address, *outcome);
  transport::Socket connected{std::move(socket)};
  transport::setNoDelay(connected);
  return connected;
}

}  // namespace

Result<transport::Socket> dial(asio::io_context& io, const transport::Address& address,
                               std::chrono::milliseconds timeout) {
  if (const auto* local = std::get_if<transport::UnixAddress>(&address))
    return dialUnix(io, *local);
  return dialTcp(io, std::get<transport::TcpAddress>(address), timeout);
}

}  // namespace toftwin::client
