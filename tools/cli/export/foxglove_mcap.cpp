// SPDX-License-Identifier: Apache-2.0
// An MCAP file of Foxglove's messages: FlatBuffers, their compiled schemas beside them.
#include "protocol/foxglove/messages.h"
#include "tools/cli/export/topic_frames.h"

namespace toftwin::cli {
namespace {

struct FoxgloveDialect {
  static constexpr const char* kProfile = "";
  static constexpr const char* kEncoding = "flatbuffer";
  static constexpr const char* kWhat = "of Foxglove (RawImage, CameraCalibration, PointCloud, FrameTransforms)";

  template <ros::Message M>
  static std::string nameOf(const M& message) {
    return std::string{foxglove::nameOf(message)};
  }
  template <ros::Message M>
  static std::vector<std::byte> encode(const M& message) {
    return foxglove::encode(message);
  }
  template <ros::Message M>
  static record::mcap::Schema schemaOf(const M& message) {
    const auto bytes = foxglove::schemaOf(foxglove::nameOf(message));
    return {.id = 0, .name = nameOf(message), .encoding = "flatbuffer", .data = {bytes.begin(), bytes.end()}};
  }
};

}  // namespace

Result<std::unique_ptr<FrameSink>> openFoxglove(const std::filesystem::path& file, const ExportOptions& how, const SinkOptions& options) {
  return openTopics<FoxgloveDialect>(file, how, options);
}

}  // namespace toftwin::cli
