// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/result.h>

#include "protocol/ros/messages.h"

/// Planes of images and clouds as ROS has them.
namespace toftwin::cli {

/// What an image of that encoding is where no name tells: 16UC1 and 32FC1 depth, grey amplitude, colours.
std::optional<PlaneKind> kindOfEncoding(const std::string& encoding);

/// Distances become metres: integers are counts of `mm_per_count`, and 0, the largest count and what is infinite become NaN
/// (REP 117, 118). Other kinds keep their numbers. Error Malformed: bytes are missing, or the encoding is none that can be read.
Result<Plane> planeOf(const ros::Image& image, PlaneKind kind, double mm_per_count);

/// A picture file in a message, or what compressed_depth_image_transport makes: 12 bytes before a PNG. Error Unsupported:
/// another compression.
struct UnpackedImage {
  Plane plane;
  PlaneKind kind;
};
Result<UnpackedImage> unpack(const ros::CompressedImage& image, std::optional<PlaneKind> kind, double mm_per_count);

/// Range, depth and what is called intensity or amplitude of an organised cloud. Empty if it has one row.
Result<std::vector<Plane>> planesOf(const ros::PointCloud2& cloud);

/// x, y and z of each point of an organised cloud, row by row.
Result<std::vector<float>> coordinatesOf(const ros::PointCloud2& cloud);

/// Distances of integers in metres.
Plane metresOf(const Plane& counts, PlaneKind kind, double mm_per_count);

}  // namespace toftwin::cli
