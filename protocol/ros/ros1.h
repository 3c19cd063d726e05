// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocol/ros/messages.h"
#include "protocol/ros/read.h"

/// The bytes of ROS 1's messages [wiki.ros.org/ROS/Technical Overview]: little end first, one member after the other without
/// gaps, and a number before each header's stamp.
namespace toftwin::ros {

struct Ros1Layout {
  static constexpr bool isSwapped() { return false; }
  static constexpr std::size_t alignment(std::size_t) { return 1; }
  static constexpr bool kTextHasZero = false;
  static constexpr std::size_t kHeaderNumber = 4;
};

/// As fromCdr.
template <Message M>
Result<M> fromRos1(ByteView bytes) {
  return readMessage<M>(Ros1Layout{}, bytes);
}

}  // namespace toftwin::ros
