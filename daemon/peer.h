// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/transport/framed_socket.h"

namespace toftwin::daemon {

/// Who is at the other end of a connection, as the kernel says: nothing that the peer claims.
struct Peer {
  std::optional<uid_t> user;  ///< of this machine; nothing: another machine, or the kernel does not tell
  std::string address{};      ///< of a TCP peer, without the port; empty: a Unix socket
  std::vector<gid_t> groups{};  ///< of the user, as far as a Unix socket tells

  /// Whose limits count for it: equal for all connections of one user of this machine, or of one other machine.
  [[nodiscard]] std::string name() const;
};

/// A Unix socket's peer by its credentials; one over TCP on this machine by the owner of its socket.
Peer peerOf(transport::Socket& socket);

/// Text of a peer for the log or a person: without control characters, at most 64 bytes of it.
std::string printable(std::string_view text);

}  // namespace toftwin::daemon
