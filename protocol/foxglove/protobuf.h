// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toftwin/result.h>

#include "protocol/ros/messages.h"

/// Foxglove's messages as most programs write them: Protocol Buffers [protobuf.dev: Encoding], by the published numbers of
/// their members.
namespace toftwin::foxglove {

/// Byte views point into `bytes`. Error Malformed: they are no such message. Members that are not known are skipped.
Result<> decodeProtobuf(ros::ByteView bytes, ros::Image& image);                ///< RawImage
Result<> decodeProtobuf(ros::ByteView bytes, ros::CompressedImage& image);      ///< CompressedImage
Result<> decodeProtobuf(ros::ByteView bytes, ros::CameraInfo& info);            ///< CameraCalibration
Result<> decodeProtobuf(ros::ByteView bytes, ros::TFMessage& transforms);       ///< FrameTransforms

}  // namespace toftwin::foxglove
