// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/ros2/loopback_only.h"

#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>

namespace toftwin::daemon::ros2 {
namespace {

/// RTPS 2.2, 9.6.1.1: the ports of a domain.
constexpr int kFirstPort = 7400, kPortsPerDomain = 250;

/// The descriptor's inode, if it is such a socket.
std::optional<ino_t> openSocket(int descriptor, int domain) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0 || !S_ISSOCK(status.st_mode)) return std::nullopt;
  int type = 0;
  socklen_t size = sizeof type;
  if (::getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM)
    return std::nullopt;
  sockaddr_in address{};
  size = sizeof address;
  if (::getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) != 0) return std::nullopt;
  const bool hears_all = address.sin_family == AF_INET && address.sin_addr.s_addr == htonl(INADDR_ANY);
  const int port = ntohs(address.sin_port) - kFirstPort - domain * kPortsPerDomain;
  return hears_all && port >= 0 && port < kPortsPerDomain ? std::optional{status.st_ino} : std::nullopt;
}

}  // namespace

Sockets openSockets(int domain) {
  Sockets sockets;
  std::error_code is_none;
  for (const auto& entry : std::filesystem::directory_iterator{"/proc/self/fd", is_none}) {
    const std::string name = entry.path().filename();
    int descriptor = -1;
    std::from_chars(name.data(), name.data() + name.size(), descriptor);
    if (const auto inode = openSocket(descriptor, domain)) sockets.emplace(descriptor, *inode);
  }
  return sockets;
}

Result<> confineNewSockets(int domain, const Sockets& before) {
  constexpr char kLoopback[] = "lo";
  int confined = 0;
  for (const auto& one : openSockets(domain)) {
    if (before.contains(one)) continue;
    // Unprivileged since Linux 5.7. Until now strangers could reach it; what they sent is no more than bytes
    // that DDS must bear anyway.
    if (::setsockopt(one.first, SOL_SOCKET, SO_BINDTODEVICE, kLoopback, sizeof kLoopback) != 0) {
      return Error{
          Error::Code::Internal,
          fmt::format("the sockets of DDS cannot be kept from other networks (SO_BINDTODEVICE lo: {}); it "
                      "needs Linux 5.7 or CAP_NET_RAW",
                      std::strerror(errno))};  // NOLINT(concurrency-mt-unsafe): glibc's is
    }
    ++confined;
  }
  if (confined == 0)
    return Error{Error::Code::Internal,
                 "the sockets of DDS are not in /proc/self/fd, so they may hear other networks"};
  return {};
}

}  // namespace toftwin::daemon::ros2
