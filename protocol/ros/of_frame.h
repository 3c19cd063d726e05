// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <toftwin/frame.h>

#include "protocol/ros/messages.h"
#include "protocol/ros/pixels.h"

/// What a frame is made of, as messages of ROS.
namespace toftwin::ros {

inline constexpr std::uint8_t kFloat32 = 7;  ///< PointField's number of 32-bit floats

/// Seconds and the rest, which is not negative; the nearest that can be said where the seconds do not fit.
Time timeOf(std::int64_t ns);

/// plumb_bob is our own model: the same five terms in the same order. Without a header.
CameraInfo infoOf(const toftwin::CameraInfo& camera);

/// Their bytes are those of `pixels` and `points`, which must live as long.
Image imageOf(const Header& header, const Pixels& pixels);
PointCloud2 cloudOf(const Header& header, const Points& points);

/// Tells where the camera is: its frame `child` in the frame of the header.
TransformStamped transformOf(const Header& header, const std::string& child, const toftwin::Transform<World, Camera>& world_from_camera);

/// An image and the word for what it shows ("depth").
struct NamedPixels {
  std::string name;
  Pixels pixels;
};
/// All planes as images, or those `wanted`; depth is made of the range where the frame has none.
std::vector<NamedPixels> imagesOf(const Frame& frame, const Rays& rays, DepthFormat format, const std::vector<PlaneKind>& wanted);

/// What ROS takes for a name: letters, digits and _; others become _.
std::string nameFor(std::string_view source);

}  // namespace toftwin::ros
