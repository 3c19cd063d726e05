// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/ros2/node.h"

#include <ros2_messages.h>

#include <algorithm>
#include <vector>

namespace toftwin::daemon::ros2 {
namespace {

using Guid = Participant::Guid;

/// Identifiers of up to 24 bytes, of which DDS' 16 come first.
template <class Gid>
Gid gidOf(const Guid& guid) {
  Gid gid{};
  std::ranges::copy(guid, gid.data);
  return gid;
}

template <class Gid>
std::vector<Gid> gidsOf(const std::vector<Guid>& guids) {
  std::vector<Gid> gids;
  for (const Guid& guid : guids) gids.push_back(gidOf<Gid>(guid));
  return gids;
}

/// Of DDS' C types, whose sequences have a type of their own each.
template <class Sequence, class Element>
Sequence sequenceOver(std::vector<Element>& elements) {
  const auto size = static_cast<std::uint32_t>(elements.size());
  return {size, size, elements.data(), false};
}

template <class Info, class Node, class Gid>
Result<> announceAs(const dds_topic_descriptor_t& type, const Keys& keys, Participant& participant) {
  const auto gid = gidOf<Gid>(participant.guid());
  auto writers = gidsOf<Gid>(participant.writers()), readers = gidsOf<Gid>(participant.readers());
  // As ROS 2's own programs have it.
  const auto writer = participant.write("ros_discovery_info", type,
                                        {.is_reliable = true, .is_latched = true, .keep_last = 1});
  if (!writer) return writer.error();
  NodeName name = nodeNameOf(keys.name);
  Node node{};
  node.node_namespace = name.space.data();
  node.node_name = name.name.data();
  node.reader_gid_seq = sequenceOver<decltype(node.reader_gid_seq)>(readers);
  node.writer_gid_seq = sequenceOver<decltype(node.writer_gid_seq)>(writers);
  Info info{};
  info.gid = gid;
  info.node_entities_info_seq = {1, 1, &node, false};
  return writer->write(&info);
}

}  // namespace

NodeName nodeNameOf(const std::string& name) {
  const std::size_t slash = name.rfind('/');
  if (slash == std::string::npos) return {"/", name};
  return {"/" + name.substr(0, slash), name.substr(slash + 1)};
}

Result<> announceNode(const Keys& keys, Participant& participant) {
  if (keys.node_info == NodeInfo::None) return {};
  if (keys.node_info == NodeInfo::Iron) {
    return announceAs<rmw_dds_common_msg_dds__ParticipantEntitiesInfo_,
                      rmw_dds_common_msg_dds__NodeEntitiesInfo_, rmw_dds_common_msg_dds__Gid_>(
        rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc, keys, participant);
  }
  // Another layout under the same name.
  dds_topic_descriptor_t type = rmw_dds_common_humble_msg_dds__ParticipantEntitiesInfo__desc;
  type.m_typename = rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc.m_typename;
  return announceAs<rmw_dds_common_humble_msg_dds__ParticipantEntitiesInfo_,
                    rmw_dds_common_humble_msg_dds__NodeEntitiesInfo_, rmw_dds_common_humble_msg_dds__Gid_>(
      type, keys, participant);
}

}  // namespace toftwin::daemon::ros2
