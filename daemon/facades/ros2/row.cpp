// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/ros2/keys.h"
#include "protocol/settings/describe.h"

namespace toftwin::daemon::ros2 {

FacadeKind facade() {
  return {
      .name = "ros2",
      .summary = "a camera of ROS 2, without ROS: images, camera info, points and transforms over DDS",
#ifdef TOFTWIN_HAS_ROS2
      .read = read,
#else
      .read = nullptr,
#endif
      .document = [] { return settings::markdownTable(settings::keysOf<Keys>()); },
#ifndef TOFTWIN_HAS_ROS2
      .not_built = "not built: install cyclonedds-dev and cyclonedds-tools and configure again",
#endif
  };
}

}  // namespace toftwin::daemon::ros2
