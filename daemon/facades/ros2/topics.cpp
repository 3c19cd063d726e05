// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/ros2/topics.h"

#include <ros2_messages.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "protocol/ros/of_frame.h"

namespace toftwin::daemon::ros2 {
namespace {

using Header = std_msgs_msg_dds__Header_;
using ImageMessage = sensor_msgs_msg_dds__Image_;
using CameraInfoMessage = sensor_msgs_msg_dds__CameraInfo_;
using PointsMessage = sensor_msgs_msg_dds__PointCloud2_;
using PointField = sensor_msgs_msg_dds__PointField_;
using TransformStamped = geometry_msgs_msg_dds__TransformStamped_;
using TransformMessage = tf2_msgs_msg_dds__TFMessage_;
using PoseMessage = geometry_msgs_msg_dds__PoseStamped_;

/// DDS' C structures know no const; what is written is only read.
char* textOf(std::string_view terminated) { return const_cast<char*>(terminated.data()); }

Header headerOf(std::int64_t stamp_ns, const std::string& frame_id) {
  const ros::Time stamp = ros::timeOf(stamp_ns);
  return {{stamp.sec, stamp.nanosec}, textOf(frame_id)};
}

dds_sequence_uint8 sequenceOf(std::vector<std::uint8_t>& bytes) {
  const auto size = static_cast<std::uint32_t>(bytes.size());
  return {size, size, bytes.data(), false};
}

Result<> writeImage(const Writer& writer, const Header& header, ros::Pixels pixels) {
  ImageMessage message{};
  message.header = header;
  message.height = pixels.height;
  message.width = pixels.width;
  message.encoding = textOf(pixels.encoding);
  message.step = pixels.width * pixels.bytes_per_pixel;
  message.data = sequenceOf(pixels.data);
  return writer.write(&message);
}

Result<> writeInfo(const Writer& writer, const Header& header, const CameraInfo& camera) {
  CameraInfoMessage message{};
  message.header = header;
  message.height = static_cast<std::uint32_t>(camera.height);
  message.width = static_cast<std::uint32_t>(camera.width);
  ros::CameraInfo lens = ros::infoOf(camera);
  message.distortion_model = textOf(lens.distortion_model);
  const auto terms = static_cast<std::uint32_t>(lens.d.size());
  message.d = {terms, terms, lens.d.data(), false};
  std::ranges::copy(lens.k, message.k);
  std::ranges::copy(lens.r, message.r);
  std::ranges::copy(lens.p, message.p);
  return writer.write(&message);
}

Result<> writePoints(const Writer& writer, const Header& header, ros::Points points) {
  constexpr std::uint32_t kFloatSize = 4;
  std::vector<PointField> fields;
  for (const std::string_view name : points.fields)
    fields.push_back({textOf(name), static_cast<std::uint32_t>(fields.size()) * kFloatSize, ros::kFloat32, 1});
  PointsMessage message{};
  message.header = header;
  message.height = points.height;
  message.width = points.width;
  const auto count = static_cast<std::uint32_t>(fields.size());
  message.fields = {count, count, fields.data(), false};
  message.point_step = count * kFloatSize;
  message.row_step = message.point_step * points.width;
  message.data = sequenceOf(points.data);
  message.is_dense = false;  // invalid points are NaN
  return writer.write(&message);
}

/// Calls `take(message)` for each that waits.
template <class Message, class Take>
void takeAll(dds_entity_t reader, Take take) {
  constexpr std::uint32_t kAtOnce = 8;
  while (true) {
    std::array<void*, kAtOnce> messages{};
    std::array<dds_sample_info_t, kAtOnce> infos{};
    const dds_return_t count = dds_take(reader, messages.data(), infos.data(), kAtOnce, kAtOnce);
    if (count <= 0) return;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      if (infos[i].valid_data) take(*static_cast<const Message*>(messages[i]));
    }
    dds_return_loan(reader, messages.data(), count);
  }
}

bool isIn(const Header& header, std::string_view frame) {
  return header.frame_id != nullptr && header.frame_id == frame;
}

}  // namespace

Result<Topics> Topics::open(const Keys& keys, Participant& participant) {
  Topics topics{keys};
  const Quality data{.is_reliable = keys.reliability == Reliability::Reliable, .keep_last = keys.keep_last};
  const bool is_static = keys.transform == TransformKind::Static;
  // As ROS 2's own broadcasters of transforms have it.
  const Quality transforms{.is_reliable = true, .is_latched = is_static, .keep_last = is_static ? 1 : 100};
  const struct {
    Writer& writer;
    std::string topic;
    const dds_topic_descriptor_t& type;
    const Quality& quality;
  } wanted[]{
      {topics.depth_, "/depth/image_raw", sensor_msgs_msg_dds__Image__desc, data},
      {topics.depth_info_, "/depth/camera_info", sensor_msgs_msg_dds__CameraInfo__desc, data},
      {topics.amplitude_, "/amplitude/image_raw", sensor_msgs_msg_dds__Image__desc, data},
      {topics.amplitude_info_, "/amplitude/camera_info", sensor_msgs_msg_dds__CameraInfo__desc, data},
      {topics.points_, "/points", sensor_msgs_msg_dds__PointCloud2__desc, data},
  };
  for (const auto& one : wanted) {
    auto writer = participant.write("/" + keys.name + one.topic, one.type, one.quality);
    if (!writer) return writer.error();
    one.writer = *writer;
  }
  if (keys.transform == TransformKind::None) return topics;
  auto writer =
      participant.write(is_static ? "/tf_static" : "/tf", tf2_msgs_msg_dds__TFMessage__desc, transforms);
  if (!writer) return writer.error();
  topics.transform_ = *writer;
  return topics;
}

std::uint32_t Topics::readers() const {
  const std::uint32_t of_transform = keys_.transform == TransformKind::Moving ? transform_.readers() : 0;
  return std::max({depth_.readers(), depth_info_.readers(), amplitude_.readers(), amplitude_info_.readers(),
                   points_.readers(), of_transform});
}

Result<bool> Topics::publish(const Frame& frame, const Damage& damage) {
  const std::int64_t stamp_ns = ros::stampOf(frame, keys_.clock);
  const Header header = headerOf(stamp_ns, keys_.frame_id);
  bool is_read = keys_.transform == TransformKind::Moving && transform_.hasReaders();
  Result<> outcome = publishTransform(frame.moment.world_from_camera, stamp_ns);
  const auto note = [&](const Result<>& one) {
    if (outcome && !one) outcome = one;
    is_read = true;
  };
  const auto strike = [&](auto& made) { damage.corrupt(std::as_writable_bytes(std::span{made.data})); };
  if ((depth_.hasReaders() || points_.hasReaders()) && (!rays_ || rays_->camera != frame.camera))
    rays_ = ros::raysOf(frame.camera);
  if (depth_info_.hasReaders()) note(writeInfo(depth_info_, header, frame.camera));
  if (amplitude_info_.hasReaders()) note(writeInfo(amplitude_info_, header, frame.camera));
  if (depth_.hasReaders()) {
    if (auto pixels = ros::depthOf(frame, *rays_, keys_.depth_format)) {
      strike(*pixels);
      note(writeImage(depth_, header, *std::move(pixels)));
    }
  }
  if (amplitude_.hasReaders()) {
    if (auto pixels = ros::amplitudeOf(frame)) {
      strike(*pixels);
      note(writeImage(amplitude_, header, *std::move(pixels)));
    }
  }
  if (points_.hasReaders()) {
    if (auto points = ros::pointsOf(frame, *rays_)) {
      strike(*points);
      note(writePoints(points_, header, *std::move(points)));
    }
  }
  if (!outcome) return outcome.error();
  return is_read;
}

Result<> Topics::tellPose(const Transform<World, Camera>& world_from_camera, HostTime now) {
  if (keys_.transform != TransformKind::Static || latched_ == world_from_camera) return {};
  return publishTransform(world_from_camera, now.ns);
}

Result<> Topics::publishTransform(const std::optional<Transform<World, Camera>>& pose,
                                  std::int64_t stamp_ns) {
  const bool is_static = keys_.transform == TransformKind::Static;
  if (!pose || keys_.transform == TransformKind::None || (is_static && latched_ == pose)) return {};
  const auto& [w, x, y, z] = pose->rotation_wxyz;
  const Vec3d& t = pose->translation_m;
  TransformStamped transform{
      headerOf(stamp_ns, keys_.parent_frame), textOf(keys_.frame_id), {{t.x, t.y, t.z}, {x, y, z, w}}};
  const TransformMessage message{{1, 1, &transform, false}};
  auto written = transform_.write(&message);
  if (written && is_static) latched_ = pose;
  return written;
}

Result<dds_entity_t> openPoseReader(const Keys& keys, Participant& participant, std::function<void()> wake) {
  // One that asks for best effort reads reliable writers, too.
  const Quality quality{.is_reliable = keys.reliability == Reliability::Reliable, .keep_last = 10};
  return participant.read(keys.pose_topic,
                          keys.pose_type == PoseType::PoseStamped ? geometry_msgs_msg_dds__PoseStamped__desc
                                                                  : tf2_msgs_msg_dds__TFMessage__desc,
                          quality, std::move(wake));
}

std::optional<TakenPose> takePose(dds_entity_t reader, const Keys& keys, int& skipped) {
  std::optional<TakenPose> last;
  if (keys.pose_type == PoseType::PoseStamped) {
    takeAll<PoseMessage>(reader, [&](const PoseMessage& message) {
      const auto& [p, q] = message.pose;
      if (!isIn(message.header, keys.parent_frame)) return void(++skipped);
      last = TakenPose{{p.x, p.y, p.z}, {q.x, q.y, q.z, q.w}};
    });
    return last;
  }
  takeAll<TransformMessage>(reader, [&](const TransformMessage& message) {
    for (const TransformStamped& one : std::span{message.transforms._buffer, message.transforms._length}) {
      // Transforms of other frames are what /tf is full of.
      if (!isIn(one.header, keys.parent_frame) || one.child_frame_id == nullptr ||
          keys.frame_id != one.child_frame_id)
        continue;
      const auto& [t, q] = one.transform;
      last = TakenPose{{t.x, t.y, t.z}, {q.x, q.y, q.z, q.w}};
    }
  });
  return last;
}

}  // namespace toftwin::daemon::ros2
