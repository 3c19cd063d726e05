// SPDX-License-Identifier: Apache-2.0
#include "daemon/vanished_peer.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdint>

namespace toftwin::daemon {

/// TCP_USER_TIMEOUT stands in for TCP_KEEPCNT and holds for what was sent, too: the kernel asks nobody while
/// that is not acknowledged, but sends it again for a quarter of an hour.
void noticeVanishedPeer(int socket, std::chrono::milliseconds patience) {
  const auto set = [socket](int level, int option, int value) {
    ::setsockopt(socket, level, option, &value, sizeof value);  // fails on a Unix socket, which needs none
  };
  const auto seconds = static_cast<int>(std::max<std::int64_t>(patience.count() / 1000, 1));
  set(SOL_SOCKET, SO_KEEPALIVE, 1);
  set(IPPROTO_TCP, TCP_KEEPIDLE, std::min(seconds, 5));
  set(IPPROTO_TCP, TCP_KEEPINTVL, std::min(seconds, 2));
  set(IPPROTO_TCP, TCP_USER_TIMEOUT, static_cast<int>(patience.count()));
}

}  // namespace toftwin::daemon
