// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "protocol/ros/messages.h"

/// Point clouds of files, as ROS's message has them: fields of points, and rows and columns where the file says them.
namespace toftwin::cli {

struct CloudFile {
  ros::PointCloud2 cloud;        ///< its data is `bytes`
  std::vector<std::byte> bytes;  ///< points one after the other, little end first
};

/// PCD, as PCL has it: text, binary, or binary_compressed. Errors Malformed and Unsupported name what cannot be read.
Result<CloudFile> readPcd(const std::filesystem::path& file);

/// PLY: text, or binary with the little end first, whose first element is the vertices. Rows and columns are those of
/// "obj_info num_cols" and "num_rows".
Result<CloudFile> readPly(const std::filesystem::path& file);

// What both have.

/// The largest file that is read: 2^26 points of 32 bytes.
inline constexpr std::uintmax_t kMostCloudBytes = 1ull << 31;
Result<std::string> readCloudText(const std::filesystem::path& file);
/// Points written as numbers, a line each, as doubles; Malformed if there are fewer than `points`.
Result<std::vector<std::byte>> pointsOfText(std::string_view text, std::size_t points, std::size_t fields, const std::string& file);

}  // namespace toftwin::cli
