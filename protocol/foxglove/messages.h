// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

#include "protocol/ros/messages.h"

/// Foxglove's messages, which say what ROS's say: as bytes (FlatBuffers), and back.
namespace toftwin::foxglove {

using ros::ByteView;

/// The message that says the same: RawImage, CameraCalibration, PointCloud or FrameTransforms. An organised cloud loses its
/// rows and columns, which Foxglove has no word for.
std::vector<std::byte> encode(const ros::Image& image);
std::vector<std::byte> encode(const ros::CameraInfo& info);
std::vector<std::byte> encode(const ros::PointCloud2& cloud);
std::vector<std::byte> encode(const ros::TFMessage& transforms);

/// "foxglove.RawImage"
constexpr std::string_view nameOf(const ros::Image&) { return "foxglove.RawImage"; }
constexpr std::string_view nameOf(const ros::CameraInfo&) { return "foxglove.CameraCalibration"; }
constexpr std::string_view nameOf(const ros::PointCloud2&) { return "foxglove.PointCloud"; }
constexpr std::string_view nameOf(const ros::TFMessage&) { return "foxglove.FrameTransforms"; }

/// The compiled schema of the message of that name; empty if it is none of these.
ByteView schemaOf(std::string_view name);

/// Undoes encode; `bytes` begin at a multiple of 8, and the byte views point into them. Error Malformed: they are no such message. A cloud has one row.
Result<> decode(ByteView bytes, ros::Image& image);
Result<> decode(ByteView bytes, ros::CameraInfo& info);
Result<> decode(ByteView bytes, ros::PointCloud2& cloud);
Result<> decode(ByteView bytes, ros::TFMessage& transforms);

}  // namespace toftwin::foxglove
