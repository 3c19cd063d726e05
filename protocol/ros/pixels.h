// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/frame.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// A frame as the pixels that the messages of ROS carry; docs/facades/ros2.md says which are which.
namespace toftwin::ros {

/// Of a depth image: metres, NaN where invalid; or millimetres, 0 where invalid.
enum class DepthFormat { Metres, Millimetres };
enum class StampClock { Host, Device };

/// Where the camera's pixels look.
struct Rays {
  toftwin::CameraInfo camera;
  std::vector<Vec3d> unit_vectors;
};
Rays raysOf(const toftwin::CameraInfo& camera);

/// Little endian, as this machine is.
struct Pixels {
  std::string encoding;  ///< as in sensor_msgs/image_encodings.hpp
  std::uint32_t width = 0, height = 0, bytes_per_pixel = 0;
  std::vector<std::uint8_t> data;
};
/// `rays` of the frame's camera; nothing if the frame has neither depth nor range.
std::optional<Pixels> depthOf(const Frame& frame, const Rays& rays, DepthFormat format);
/// In the source's own unit.
std::optional<Pixels> amplitudeOf(const Frame& frame);
/// Any plane as it is, the channels of a pixel side by side: mono8, mono16, rgb8 for colours, else as "32FC3".
Pixels pixelsOf(const Plane& plane);
/// The plane that such pixels were made of; nothing if the bytes of a row (`step`) or of all are not there, or the encoding
/// is none of those. `data` first byte of the first row.
std::optional<Plane> planeOf(PlaneKind kind, std::string_view encoding, std::uint32_t width, std::uint32_t height,
                             std::uint32_t step, bool is_bigendian, std::span<const std::byte> data);

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

}  // namespace toftwin::ros
