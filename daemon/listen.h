// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include <toftwin/result.h>

#include "protocol/transport/memfd.h"

namespace toftwin::daemon {

/// Listens on a TCP port; port 0 is any free one. An error names who holds the port and what to do: change
/// `setting`.
Result<boost::asio::ip::tcp::acceptor> listenTcp(boost::asio::io_context& io,
                                                 const std::string& address, std::uint16_t port,
                                                 std::string_view setting = "listen.port or --port");

/// A Unix socket that this process alone listens on. A lock file beside it tells a second daemon,
/// whose pid it names; a socket that a killed daemon left behind is replaced.
class UnixListener {
 public:
  static Result<UnixListener> open(boost::asio::io_context& io, const std::filesystem::path& path);
  UnixListener(UnixListener&&) noexcept = default;
  UnixListener& operator=(UnixListener&&) = delete;
  /// Removes the socket.
  ~UnixListener();

  boost::asio::local::stream_protocol::acceptor& acceptor() { return acceptor_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  UnixListener(std::filesystem::path path, transport::FileDescriptor lock,
               boost::asio::local::stream_protocol::acceptor acceptor)
      : path_(std::move(path)), lock_(std::move(lock)), acceptor_(std::move(acceptor)) {}
  std::filesystem::path path_;
  transport::FileDescriptor lock_;  // holds the lock as long as it is open
  boost::asio::local::stream_protocol::acceptor acceptor_;
};

/// "toftwind (pid 123)": the process that listens on a TCP port of this machine, or "another
/// process" if it is not ours to look at.
std::string whoListensOn(std::uint16_t port);

}  // namespace toftwin::daemon
