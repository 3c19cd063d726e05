// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/facades/ros2/keys.h"
#include "daemon/facades/ros2/participant.h"

namespace toftwin::daemon::ros2 {

/// The topics to which a camera writes, named after keys.name; its frames become their messages.
class Topics {
 public:
  static Result<Topics> open(const Keys& keys, Participant& participant);

  /// Whether anybody reads what comes with each frame.
  [[nodiscard]] bool hasReaders() const { return readers() > 0; }
  /// Of the one of those topics that has the most.
  [[nodiscard]] std::uint32_t readers() const;
  /// Makes and writes those messages that are read, with the damage in the pixels of each. Whether there were
  /// any, or the first error; the others are written all the same.
  Result<bool> publish(const Frame& frame, const Damage& damage);
  /// Tells where the camera is, if /tf_static has not told yet: a pose that was set is told also where nobody
  /// reads images, so that no frame comes to tell it.
  Result<> tellPose(const Transform<World, Camera>& world_from_camera, HostTime now);

 private:
  explicit Topics(const Keys& keys) : keys_(keys) {}
  Result<> publishTransform(const std::optional<Transform<World, Camera>>& pose, std::int64_t stamp_ns);

  Keys keys_;
  Writer depth_, depth_info_, amplitude_, amplitude_info_, points_, transform_;
  std::optional<ros::Rays> rays_;
  std::optional<Transform<World, Camera>> latched_;
};

/// What a pose message says of the camera; empty if there is nothing to take, or it is about something else.
struct TakenPose {
  std::array<double, 3> position_m{};
  std::array<double, 4> rotation_xyzw{};
};
/// The last of the poses that wait at the reader; `skipped` counts the messages that are of other frames.
std::optional<TakenPose> takePose(dds_entity_t reader, const Keys& keys, int& skipped);

/// Of the topic `keys.pose_topic`.
Result<dds_entity_t> openPoseReader(const Keys& keys, Participant& participant, std::function<void()> wake);

}  // namespace toftwin::daemon::ros2
