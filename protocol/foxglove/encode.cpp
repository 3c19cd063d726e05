// SPDX-License-Identifier: Apache-2.0
#include <foxglove_generated.h>

#include "protocol/foxglove/messages.h"

namespace toftwin::foxglove {
namespace {

namespace fb = ::foxglove;
using Builder = flatbuffers::FlatBufferBuilder;

/// Foxglove's seconds have no sign: what is before 1970 is at its beginning.
fb::Time timeOf(const ros::Time& stamp) {
  return stamp.sec < 0 ? fb::Time{0, 0} : fb::Time{static_cast<std::uint32_t>(stamp.sec), stamp.nanosec};
}

flatbuffers::Offset<flatbuffers::Vector<std::uint8_t>> dataOf(Builder& builder, ByteView bytes) {
  return builder.CreateVector(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
}

template <class Numbers>
flatbuffers::Offset<flatbuffers::Vector<double>> numbersOf(Builder& builder, const Numbers& numbers) {
  return builder.CreateVector(numbers.data(), numbers.size());
}

template <class Root>
std::vector<std::byte> finish(Builder& builder, Root root) {
  builder.Finish(root);
  const auto bytes = std::as_bytes(std::span{builder.GetBufferPointer(), builder.GetSize()});
  return {bytes.begin(), bytes.end()};
}

}  // namespace

std::vector<std::byte> encode(const ros::Image& image) {
  Builder builder(image.data.size() + 512);
  const auto data = dataOf(builder, image.data);
  const auto frame = builder.CreateString(image.header.frame_id), encoding = builder.CreateString(image.encoding);
  const fb::Time stamp = timeOf(image.header.stamp);
  return finish(builder, fb::CreateRawImage(builder, &stamp, frame, image.width, image.height, encoding, image.step, data));
}

std::vector<std::byte> encode(const ros::CameraInfo& info) {
  Builder builder;
  const auto frame = builder.CreateString(info.header.frame_id), model = builder.CreateString(info.distortion_model);
  const auto d = numbersOf(builder, info.d), k = numbersOf(builder, info.k), r = numbersOf(builder, info.r), p = numbersOf(builder, info.p);
  const fb::Time stamp = timeOf(info.header.stamp);
  return finish(builder, fb::CreateCameraCalibration(builder, &stamp, frame, info.width, info.height, model, d, k, r, p));
}

std::vector<std::byte> encode(const ros::PointCloud2& cloud) {
  Builder builder(cloud.data.size() + 1024);
  const auto data = dataOf(builder, cloud.data);
  std::vector<flatbuffers::Offset<fb::PackedElementField>> elements;
  for (const ros::PointField& field : cloud.fields) {
    // ROS counts types from the signed ones, Foxglove from the unsigned: 1 int8, 2 uint8 there is 2, 1 here, and so on.
    const bool is_integer = field.datatype >= 1 && field.datatype <= 6;
    const int type = is_integer ? ((field.datatype - 1) ^ 1) + 1 : field.datatype;
    elements.push_back(fb::CreatePackedElementField(builder, builder.CreateString(field.name), field.offset, static_cast<fb::NumericType>(type)));
  }
  const auto fields = builder.CreateVector(elements);
  const auto pose = fb::CreatePose(builder, fb::CreateVector3(builder), fb::CreateQuaternion(builder));
  const auto frame = builder.CreateString(cloud.header.frame_id);
  const fb::Time stamp = timeOf(cloud.header.stamp);
  return finish(builder, fb::CreatePointCloud(builder, &stamp, frame, pose, cloud.point_step, fields, data));
}

std::vector<std::byte> encode(const ros::TFMessage& transforms) {
  Builder builder;
  std::vector<flatbuffers::Offset<fb::FrameTransform>> all;
  for (const ros::TransformStamped& one : transforms.transforms) {
    const auto& [t, q] = one.transform;
    const auto translation = fb::CreateVector3(builder, t.x, t.y, t.z);
    const auto rotation = fb::CreateQuaternion(builder, q.x, q.y, q.z, q.w);
    const auto parent = builder.CreateString(one.header.frame_id), child = builder.CreateString(one.child_frame_id);
    const fb::Time stamp = timeOf(one.header.stamp);
    all.push_back(fb::CreateFrameTransform(builder, &stamp, parent, child, translation, rotation));
  }
  return finish(builder, fb::CreateFrameTransforms(builder, builder.CreateVector(all)));
}

}  // namespace toftwin::foxglove
