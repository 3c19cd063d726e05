// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <foxglove_generated.h>

#include <algorithm>
#include <limits>

#include "protocol/foxglove/messages.h"

namespace toftwin::foxglove {
namespace {

namespace fb = ::foxglove;

/// The root of bytes that were verified: every offset in them lies within them.
template <class Table, class Message>
Result<const Table*> rootOf(ByteView bytes, const Message& message) {
  const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  flatbuffers::Verifier verifier{data, bytes.size()};
  if (bytes.size() >= 8 && verifier.VerifyBuffer<Table>(nullptr)) return flatbuffers::GetRoot<Table>(data);
  return Error{Error::Code::Malformed, fmt::format("a message that is no {}", nameOf(message))};
}

std::string textOf(const flatbuffers::String* text) { return text != nullptr ? text->str() : std::string{}; }

ros::Header headerOf(const fb::Time* stamp, const flatbuffers::String* frame) {
  ros::Header header;
  if (stamp != nullptr) {
    constexpr std::uint32_t kMost = std::numeric_limits<std::int32_t>::max();
    header.stamp = {static_cast<std::int32_t>(std::min(stamp->sec(), kMost)), stamp->nsec()};
  }
  header.frame_id = textOf(frame);
  return header;
}

ByteView viewOf(const flatbuffers::Vector<std::uint8_t>* data) {
  return data != nullptr ? std::as_bytes(std::span{data->data(), data->size()}) : ByteView{};
}

template <std::size_t n>
bool copy(const flatbuffers::Vector<double>* from, std::array<double, n>& to) {
  if (from == nullptr || from->size() != n) return false;
  std::ranges::copy(*from, to.begin());
  return true;
}

}  // namespace

Result<> decode(ByteView bytes, ros::Image& image) {
  const auto root = rootOf<fb::RawImage>(bytes, image);
  if (!root) return root.error();
  const fb::RawImage& raw = **root;
  image.header = headerOf(raw.timestamp(), raw.frame_id());
  image.width = raw.width();
  image.height = raw.height();
  image.encoding = textOf(raw.encoding());
  image.step = raw.step();
  image.data = viewOf(raw.data());
  return {};
}

Result<> decode(ByteView bytes, ros::CameraInfo& info) {
  const auto root = rootOf<fb::CameraCalibration>(bytes, info);
  if (!root) return root.error();
  const fb::CameraCalibration& lens = **root;
  info.header = headerOf(lens.timestamp(), lens.frame_id());
  info.width = lens.width();
  info.height = lens.height();
  info.distortion_model = textOf(lens.distortion_model());
  if (lens.d() != nullptr) info.d.assign(lens.d()->begin(), lens.d()->end());
  if (!copy(lens.k(), info.k)) return Error{Error::Code::Malformed, "a foxglove.CameraCalibration without the nine numbers of k"};
  static_cast<void>(copy(lens.r(), info.r));
  static_cast<void>(copy(lens.p(), info.p));
  return {};
}

Result<> decode(ByteView bytes, ros::PointCloud2& cloud) {
  const auto root = rootOf<fb::PointCloud>(bytes, cloud);
  if (!root) return root.error();
  const fb::PointCloud& points = **root;
  cloud.header = headerOf(points.timestamp(), points.frame_id());
  cloud.point_step = points.point_stride();
  cloud.data = viewOf(points.data());
  cloud.height = 1;
  cloud.width = cloud.point_step > 0 ? static_cast<std::uint32_t>(cloud.data.size() / cloud.point_step) : 0;
  cloud.row_step = static_cast<std::uint32_t>(cloud.data.size());
  if (points.fields() == nullptr) return {};
  for (const fb::PackedElementField* field : *points.fields()) {
    const int type = static_cast<int>(field->type());
    const bool is_integer = type >= 1 && type <= 6;
    cloud.fields.push_back({textOf(field->name()), field->offset(), static_cast<std::uint8_t>(is_integer ? ((type - 1) ^ 1) + 1 : type), 1});
  }
  return {};
}

Result<> decode(ByteView bytes, ros::TFMessage& transforms) {
  const auto root = rootOf<fb::FrameTransforms>(bytes, transforms);
  if (!root) return root.error();
  if ((*root)->transforms() == nullptr) return {};
  for (const fb::FrameTransform* one : *(*root)->transforms()) {
    ros::TransformStamped transform;
    transform.header = headerOf(one->timestamp(), one->parent_frame_id());
    transform.child_frame_id = textOf(one->child_frame_id());
    if (const fb::Vector3* t = one->translation()) transform.transform.translation = {t->x(), t->y(), t->z()};
    if (const fb::Quaternion* q = one->rotation()) transform.transform.rotation = {q->x(), q->y(), q->z(), q->w()};
    transforms.transforms.push_back(std::move(transform));
  }
  return {};
}

}  // namespace toftwin::foxglove
