// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <toftwin/result.h>

namespace toftwin::drivers::aravis {

/// What the packets of a GigE stream can be.
struct StreamShape {
  bool is_multipart = false;
  std::uint32_t frame_bytes = 0;   ///< of the library's buffers
  std::uint32_t packet_bytes = 0;  ///< with IP and UDP headers
};

/// Has the kernel throw away packets that the library believes and must not: it reserves memory for
/// as many packets as a leader or trailer says, and writes where a packet's number says. libaravis
/// 0.8.26 ends the process on some of them.
Result<> filterPackets(int socket, const StreamShape& shape);

}  // namespace toftwin::drivers::aravis
