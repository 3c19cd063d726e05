// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/v4l2/description.h"
#include "drivers/v4l2/device.h"
#include "drivers/v4l2/v4l2.h"

/// From the words of a [[source]] table to the nodes of one camera.
namespace toftwin::drivers::v4l2 {

/// A camera that is there: its nodes in the order of their numbers, and the one that was named, if
/// the user named a node.
struct CameraNodes {
  std::vector<Node> nodes;
  std::optional<Node> named;
};
Result<CameraNodes> findCamera(System& system, const std::string& uri, const std::string& place);

/// The description that the keys name; nothing if they name none, or after complaining about the key `camera`.
std::optional<Description> describedBy(const Keys& keys, settings::Table& table);
/// The description that comes along and matches the camera, or an empty one.
Description descriptionFor(const Node& node);

/// Where its images come from. Infrared has no node of its own if the depth's format has it.
struct Choice {
  Node depth;
  const PixelFormat* depth_format = nullptr;
  std::optional<Node> infrared;
  const PixelFormat* infrared_format = nullptr;
};
Result<Choice> choose(const CameraNodes& camera, const Description& description, bool infrared);

/// Bus infos of the cameras that have depth by definition or by a description that comes along.
std::vector<std::string> depthCameras(System& system);

}  // namespace toftwin::drivers::v4l2
