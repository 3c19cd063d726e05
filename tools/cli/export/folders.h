// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "tools/cli/export/frame_sink.h"

/// Folders of pictures and lists, as programs that work on sequences have them.
namespace toftwin::cli {

/// A folder as of TUM's RGB-D benchmark: depth/ in pictures of 5000 counts a metre, depth.txt, groundtruth.txt with the poses,
/// gray/ and gray.txt with the amplitude, rgb/ and rgb.txt with colours, and camera.yaml with the lens, as ROS has it.
Result<std::unique_ptr<FrameSink>> openTumFolder(const std::filesystem::path& folder, const ExportOptions& how, const SinkOptions& options);

/// A folder as COLMAP's: images/, sparse/0/cameras.txt, images.txt and points3D.txt with lens and poses as text, and
/// depth_maps/NAME.geometric.bin.
Result<std::unique_ptr<FrameSink>> openColmapFolder(const std::filesystem::path& folder, const ExportOptions& how, const SinkOptions& options);

/// The lens in the words of ROS's camera_calibration_parsers (camera_info in YAML).
std::string cameraYaml(const CameraInfo& camera, const std::string& name);

/// The pixel's depth in metres, NaN where invalid, made of the range where the frame has no depth.
Result<Image<float>> depthImageOf(const Frame& frame);

}  // namespace toftwin::cli
