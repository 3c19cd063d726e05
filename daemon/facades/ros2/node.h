// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/result.h>

#include <string>

#include "daemon/facades/ros2/keys.h"
#include "daemon/facades/ros2/participant.h"

namespace toftwin::daemon::ros2 {

/// Tells ROS 2's programs that the participant's writers and readers are a node's, so that `ros2 node list`
/// and rqt_graph show it: the message rmw_dds_common/ParticipantEntitiesInfo, kept for those that come later.
/// Of the writers and readers that there are by now. Nothing, if keys.node_info is None.
Result<> announceNode(const Keys& keys, Participant& participant);

/// "/front" and "cam" of "front/cam"; "/" where the name has one part.
struct NodeName {
  std::string space, name;
};
NodeName nodeNameOf(const std::string& name);

}  // namespace toftwin::daemon::ros2
