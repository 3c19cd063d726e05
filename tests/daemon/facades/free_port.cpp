// SPDX-License-Identifier: Apache-2.0
#include "free_port.h"

#include <fcntl.h>
#include <unistd.h>

#include <utility>  // before asio: Boost 1.74 uses std::exchange without it

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

#include <stdexcept>
#include <string>

namespace toftwin::daemon::test {
namespace {

/// Below those that Linux gives to whoever asks for any, so that none of these is given away before it is
/// listened at.
constexpr std::uint16_t kFirst = 20'000, kLast = 32'767;

/// A file of this user's with a byte for each port, which the process that locked it has until it ends.
int lockFile() {
  const std::string path = "/tmp/toftwin-test-ports-" + std::to_string(::getuid());
  const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (file < 0) throw std::runtime_error("cannot open " + path);
  return file;
}

bool lock(std::uint16_t port) {
  static const int file = lockFile();
  struct flock byte {};
  byte.l_type = F_WRLCK;
  byte.l_whence = SEEK_SET;
  byte.l_start = port;
  byte.l_len = 1;
  return ::fcntl(file, F_SETLK, &byte) == 0;
}

bool isFree(std::uint16_t port) {
  boost::asio::io_context io;
  boost::asio::ip::tcp::acceptor acceptor{io, boost::asio::ip::tcp::v4()};
  boost::system::error_code error;
  acceptor.set_option(boost::asio::ip::tcp::acceptor::reuse_address{true});
  acceptor.bind({boost::asio::ip::address_v4::loopback(), port}, error);
  return !error;
}

}  // namespace

std::uint16_t freePort() {
  constexpr int kPorts = kLast - kFirst + 1;
  // Each process begins elsewhere and goes on from there, so that a port is not given twice.
  static int next = static_cast<int>(::getpid() * 61L % kPorts);
  for (int tried = 0; tried < kPorts; ++tried) {
    const auto port = static_cast<std::uint16_t>(kFirst + next);
    next = (next + 1) % kPorts;
    if (lock(port) && isFree(port)) return port;
  }
  throw std::runtime_error("no port is free");
}

}  // namespace toftwin::daemon::test
