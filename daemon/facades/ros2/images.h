// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/frame.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "daemon/facades/ros2/keys.h"

/// A frame as the pixels that ROS 2's messages carry; docs/facades/ros2.md says which are which.
namespace toftwin::daemon::ros2 {

/// Where the camera's pixels look.
struct Rays {
  CameraInfo camera;
  std::vector<Vec3d> unit_vectors;
};
Rays raysOf(const CameraInfo& camera);

/// Little endian, as this machine is.
struct Pixels {
  std::string_view encoding;  ///< as in sensor_msgs/image_encodings.hpp
  std::uint32_t width = 0, height = 0, bytes_per_pixel = 0;
  std::vector<std::uint8_t> data;
};
/// `rays` of the frame's camera; nothing if the frame has neither depth nor range.
std::optional<Pixels> depthOf(const Frame& frame, const Rays& rays, DepthFormat format);
/// In the source's own unit.
std::optional<Pixels> amplitudeOf(const Frame& frame);

struct Points {
  std::uint32_t width = 0, height = 0;
  std::span<const std::string_view> fields;  ///< 32-bit floats, one after the other
  std::vector<std::uint8_t> data;
};
/// One point per pixel, NaN where it is invalid: x, y, z in metres, and the amplitude as intensity if there
/// is one.
std::optional<Points> pointsOf(const Frame& frame, const Rays& rays);

/// When the frame's first exposure began, or when it was received if that is not known.
std::int64_t stampOf(const Frame& frame, StampClock clock);

}  // namespace toftwin::daemon::ros2
