// SPDX-License-Identifier: Apache-2.0
#include "daemon/peer.h"

#include <linux/inet_diag.h>
#include <linux/netlink.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <boost/asio/ip/tcp.hpp>

#include <fmt/format.h>

#include <array>
#include <cstring>

#include "protocol/transport/memfd.h"

namespace toftwin::daemon {
namespace {

using boost::asio::ip::tcp;

/// The endpoints of a TCP socket as its peer has them: the peer's first.
struct Line {
  tcp::endpoint from, to;
};

std::optional<tcp::endpoint> endpointOf(const transport::Socket::endpoint_type& any) {
  tcp::endpoint endpoint;
  if (any.size() > endpoint.capacity()) return std::nullopt;
  std::memcpy(endpoint.data(), any.data(), any.size());
  endpoint.resize(any.size());
  return endpoint;
}

Peer unixPeerOf(int socket) {
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) return {};
  constexpr std::size_t kMostGroups = 1024;
  std::vector<gid_t> groups(kMostGroups);
  size = static_cast<socklen_t>(groups.size() * sizeof(gid_t));
  const bool are_told = ::getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &size) == 0;
  groups.resize(are_told ? size / sizeof(gid_t) : 0);
  groups.push_back(credentials.gid);
  return {credentials.uid, {}, std::move(groups)};
}

void put(const tcp::endpoint& endpoint, __be32 (&address)[4], __be16& port) {
  port = htons(endpoint.port());
  if (endpoint.address().is_v4()) {
    const auto bytes = endpoint.address().to_v4().to_bytes();
    std::memcpy(address, bytes.data(), bytes.size());
  } else {
    const auto bytes = endpoint.address().to_v6().to_bytes();
    std::memcpy(address, bytes.data(), bytes.size());
  }
}

/// Asks the kernel who owns the socket at the line's other end (sock_diag(7)), which is on this machine.
std::optional<uid_t> ownerOfTcpPeer(const Line& line) {
  struct Question {
    nlmsghdr head;
    inet_diag_req_v2 body;
  } question{};
  question.head.nlmsg_len = sizeof question;
  question.head.nlmsg_type = SOCK_DIAG_BY_FAMILY;
  question.head.nlmsg_flags = NLM_F_REQUEST;
  question.body.sdiag_family = line.from.address().is_v4() ? AF_INET : AF_INET6;
  question.body.sdiag_protocol = IPPROTO_TCP;
  question.body.idiag_states = ~0U;
  put(line.from, question.body.id.idiag_src, question.body.id.idiag_sport);
  put(line.to, question.body.id.idiag_dst, question.body.id.idiag_dport);
  question.body.id.idiag_cookie[0] = question.body.id.idiag_cookie[1] = INET_DIAG_NOCOOKIE;
  const transport::FileDescriptor kernel{::socket(AF_NETLINK, SOCK_DGRAM | SOCK_CLOEXEC, NETLINK_SOCK_DIAG)};
  if (!kernel || ::send(kernel.get(), &question, sizeof question, 0) < 0) return std::nullopt;
  alignas(nlmsghdr) std::array<char, 1024> answer{};
  const ssize_t size = ::recv(kernel.get(), answer.data(), answer.size(), MSG_DONTWAIT);  // it is there already
  if (size < static_cast<ssize_t>(NLMSG_LENGTH(sizeof(inet_diag_msg)))) return std::nullopt;
  nlmsghdr head;
  inet_diag_msg found;
  std::memcpy(&head, answer.data(), sizeof head);
  if (head.nlmsg_type != SOCK_DIAG_BY_FAMILY) return std::nullopt;
  std::memcpy(&found, answer.data() + NLMSG_HDRLEN, sizeof found);
  return found.idiag_uid;
}

}  // namespace

std::string Peer::name() const {
  if (user) return fmt::format("user {}", *user);
  return address.empty() ? "an unknown user" : address;
}

Peer peerOf(transport::Socket& socket) {
  boost::system::error_code fault;
  const auto local = socket.local_endpoint(fault);
  if (fault) return {};
  if (local.protocol().family() == AF_UNIX) return unixPeerOf(socket.native_handle());
  const auto remote = socket.remote_endpoint(fault);
  if (fault) return {};
  const auto from = endpointOf(remote), to = endpointOf(local);
  if (!from || !to) return {};
  // From an address of this machine to another, or the same: whoever is on loopback, or has the very address.
  const bool is_here = from->address().is_loopback() || from->address() == to->address();
  return {is_here ? ownerOfTcpPeer({*from, *to}) : std::nullopt, from->address().to_string(), {}};
}

std::string printable(std::string_view text) {
  constexpr std::size_t kLongest = 64;
  std::string clean;
  for (const char c : text.substr(0, kLongest)) {
    const auto byte = static_cast<unsigned char>(c);
    clean += byte < 0x20 || byte >= 0x7F ? '?' : c;
  }
  return clean;
}

}  // namespace toftwin::daemon
