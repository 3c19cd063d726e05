// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "daemon/facades/facade.h"
#include "daemon/facades/struck_frames.h"
#include "protocol/ros/pixels.h"

/// A source as a camera of ROS 2, without ROS: its messages and names over DDS.
namespace toftwin::daemon::ros2 {

using ros::DepthFormat, ros::StampClock;
enum class Reliability { BestEffort, Reliable };
enum class TransformKind { Static, Moving, None };
enum class PoseType { PoseStamped, TransformMessage };
enum class NodeInfo { Iron, Humble, None };

/// The keys of a [[facade]] table with kind = "ros2".
struct Keys {
  std::string name;
  int domain = 0;
  DepthFormat depth_format = DepthFormat::Metres;
  Reliability reliability = Reliability::Reliable;
  int keep_last = 5;
  StampClock clock = StampClock::Host;
  std::string frame_id;
  std::string parent_frame = "world";
  TransformKind transform = TransformKind::Static;
  std::string pose_topic;
  PoseType pose_type = PoseType::PoseStamped;
  bool trigger_on_pose = false;
  NodeInfo node_info = NodeInfo::Iron;
  bool diagnostics = true;
  std::vector<std::string> peers;
  FrameLineKeys line;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "before the names of the topics, as in /NAME/points; empty: the source's name");
    v.number("domain", domain, {0, 232}, "DDS domain: what ROS 2 programs have as ROS_DOMAIN_ID");
    v.choice("depth_format", depth_format,
             {{"32FC1", DepthFormat::Metres}, {"16UC1", DepthFormat::Millimetres}},
             "of the depth image: metres, NaN where invalid; or millimetres, 0 where invalid");
    v.choice(
        "reliability", reliability,
        {{"best_effort", Reliability::BestEffort}, {"reliable", Reliability::Reliable}},
        "of images, points and camera info: sent again until read, to those readers that ask for that; or "
        "once, "
        "as ROS 2's sensor data, of which a reader that asks for reliable ones (the default of rviz2 and of "
        "subscriptions) gets nothing");
    v.number("keep_last", keep_last, {1, 100}, "messages of a topic that wait for a slow reliable reader");
    v.choice("clock", clock, {{"host", StampClock::Host}, {"device", StampClock::Device}},
             "of header.stamp, when the first exposure began: this machine's clock, as ROS time is, or the "
             "source's own");
    v.text("frame_id", frame_id, "of the camera: x right, y down, z forward; empty: NAME_optical_frame");
    v.text("parent_frame", parent_frame, "in which the camera's pose is, where the source knows it");
    v.choice(
        "transform", transform,
        {{"static", TransformKind::Static}, {"moving", TransformKind::Moving}, {"none", TransformKind::None}},
        "where the pose is told: on /tf_static, anew when it changes; on /tf with each frame; nowhere");
    v.text(
        "pose_topic", pose_topic,
        "a topic, such as /amr/camera_pose: a simulated camera is put where its messages say; empty: none");
    v.choice("pose_type", pose_type,
             {{"PoseStamped", PoseType::PoseStamped}, {"TFMessage", PoseType::TransformMessage}},
             "of those messages: geometry_msgs/PoseStamped in parent_frame, or tf2_msgs/TFMessage, of which "
             "the transform from frame_id to parent_frame is taken");
    v.flag("trigger_on_pose", trigger_on_pose,
           "whether each pose also asks for a frame: in lockstep with a source that waits for triggers");
    v.choice("node_info", node_info,
             {{"iron", NodeInfo::Iron}, {"humble", NodeInfo::Humble}, {"none", NodeInfo::None}},
             "for programs of which ROS 2 the camera is a node, in ros2 node list and rqt_graph: Iron and "
             "newer, such "
             "as Jazzy; Humble and older; of none");
    v.flag("diagnostics", diagnostics, "whether /diagnostics tells every second how the source is");
    v.texts("peers", peers,
            "IP addresses of machines whose programs are looked for, where multicast does not reach them");
    v.group("line", line, "what goes wrong on purpose with a frame's messages");
  }
};

FacadeKind facade();

#ifdef TOFTWIN_HAS_ROS2
FacadeKind::Start read(settings::Table& table);
#endif

}  // namespace toftwin::daemon::ros2
