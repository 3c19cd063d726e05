// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/import/bag/transforms.h"

#include <cmath>

#include "sim/tracer/motion.h"

namespace toftwin::cli {
namespace {

constexpr int kMostLevels = 64;
constexpr std::size_t kMostFrames = 4096, kMostTimes = 4096;
constexpr std::int64_t kFar_ns = 100'000'000;

}  // namespace

void Transforms::add(const ros::TFMessage& message, bool is_static) {
  for (const ros::TransformStamped& one : message.transforms) {
    const auto& [t, q] = one.transform;
    const double length = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    const bool is_pose = std::isfinite(t.x) && std::isfinite(t.y) && std::isfinite(t.z) && std::abs(length - 1.0) < 1e-3;
    if (!is_pose || (children_.size() >= kMostFrames && !children_.contains(one.child_frame_id))) continue;
    Child& child = children_[one.child_frame_id];
    if (child.parent != one.header.frame_id) child = {one.header.frame_id, is_static, {}};
    if (is_static) child.at.clear();
    // What is a unit quaternion as far as doubles go stays bit for bit.
    const double scale = std::abs(length - 1.0) < 1e-12 ? 1.0 : length;
    const std::int64_t time_ns = std::int64_t{one.header.stamp.sec} * 1'000'000'000 + one.header.stamp.nanosec;
    child.at[time_ns] = {{q.w / scale, q.x / scale, q.y / scale, q.z / scale}, {t.x, t.y, t.z}};
    if (child.at.size() > kMostTimes) child.at.erase(child.at.begin());
  }
}

std::optional<Transforms::Any> Transforms::valueAt(const Child& child, std::int64_t time_ns) {
  if (child.at.empty()) return std::nullopt;
  if (child.is_static) return child.at.rbegin()->second;
  const auto after = child.at.lower_bound(time_ns);
  if (after != child.at.end() && after->first == time_ns) return after->second;
  const bool has_after = after != child.at.end(), has_before = after != child.at.begin();
  const auto isNear = [&](const auto& one) { return std::abs(static_cast<double>(one.first) - static_cast<double>(time_ns)) <= static_cast<double>(kFar_ns); };
  if (!has_after || !has_before) {
    const auto& only = has_after ? *after : *std::prev(after);
    return isNear(only) ? std::optional{only.second} : std::nullopt;
  }
  const auto& before = *std::prev(after);
  if (!isNear(before) && !isNear(*after)) return std::nullopt;
  const double share = static_cast<double>(time_ns - before.first) / static_cast<double>(after->first - before.first);
  return Any{sim::slerp(before.second.rotation_wxyz, after->second.rotation_wxyz, share),
             before.second.translation_m * (1.0 - share) + after->second.translation_m * share};
}

std::optional<Transform<World, Camera>> Transforms::poseOf(const std::string& frame, std::int64_t time_ns) const {
  auto found = children_.find(frame);
  if (found == children_.end()) return std::nullopt;
  std::optional<Any> pose;
  for (int level = 0; level < kMostLevels && found != children_.end(); ++level) {
    const auto value = valueAt(found->second, time_ns);
    if (!value) return std::nullopt;
    // Frames in between have no types of their own.
    pose = pose ? Any{(Transform<World, World>{value->rotation_wxyz, value->translation_m} * *pose)} : *value;
    found = children_.find(found->second.parent);
  }
  return pose;
}

std::string Transforms::rootOf(std::string frame) const {
  for (int level = 0; level < kMostLevels; ++level) {
    const auto found = children_.find(frame);
    if (found == children_.end()) break;
    frame = found->second.parent;
  }
  return frame;
}

}  // namespace toftwin::cli
