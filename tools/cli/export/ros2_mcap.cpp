// SPDX-License-Identifier: Apache-2.0
// A bag of ROS 2 in MCAP: messages in CDR, their definitions beside them.
#include "protocol/ros/cdr.h"
#include "protocol/ros/definition.h"
#include "tools/cli/export/topic_frames.h"

namespace toftwin::cli {
namespace {

struct Ros2Dialect {
  static constexpr const char* kProfile = "ros2";
  static constexpr const char* kEncoding = "cdr";
  static constexpr const char* kWhat = "of ROS 2 (sensor_msgs, tf2_msgs; CDR)";

  template <ros::Message M>
  static std::string nameOf(const M&) {
    std::string type{M::kName};
    return type.insert(type.find('/'), "/msg");  // "sensor_msgs/msg/Image"
  }
  template <ros::Message M>
  static std::vector<std::byte> encode(const M& message) {
    return ros::toCdr(message);
  }
  template <ros::Message M>
  static record::mcap::Schema schemaOf(const M& message) {
    const std::string text = ros::Definition::of<M>();
    const auto bytes = std::as_bytes(std::span{text});
    return {.id = 0, .name = nameOf(message), .encoding = "ros2msg", .data = {bytes.begin(), bytes.end()}};
  }
};

}  // namespace

Result<std::unique_ptr<FrameSink>> openRos2(const std::filesystem::path& file, const ExportOptions& how, const SinkOptions& options) {
  return openTopics<Ros2Dialect>(file, how, options);
}

}  // namespace toftwin::cli
