// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace toftwin::daemon {

/// A peer whose machine or cable went away says nothing. The kernel asks it while nothing is sent, and breaks
/// the connection after so long without an answer, be it to that or to what was sent. `socket` is of TCP; a
/// Unix socket needs none of it, and stays as it is.
void noticeVanishedPeer(int socket, std::chrono::milliseconds patience);

}  // namespace toftwin::daemon
