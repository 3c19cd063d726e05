// SPDX-License-Identifier: Apache-2.0
#include <foxglove_CameraCalibration_bfbs_generated.h>
#include <foxglove_FrameTransforms_bfbs_generated.h>
#include <foxglove_PointCloud_bfbs_generated.h>
#include <foxglove_RawImage_bfbs_generated.h>

#include "protocol/foxglove/messages.h"

namespace toftwin::foxglove {
namespace {

template <class Schema>
ByteView bytesOf() {
  return std::as_bytes(std::span{Schema::data(), Schema::size()});
}

}  // namespace

ByteView schemaOf(std::string_view name) {
  if (name == nameOf(ros::Image{})) return bytesOf<::foxglove::RawImageBinarySchema>();
  if (name == nameOf(ros::CameraInfo{})) return bytesOf<::foxglove::CameraCalibrationBinarySchema>();
  if (name == nameOf(ros::PointCloud2{})) return bytesOf<::foxglove::PointCloudBinarySchema>();
  if (name == nameOf(ros::TFMessage{})) return bytesOf<::foxglove::FrameTransformsBinarySchema>();
  return {};
}

}  // namespace toftwin::foxglove
