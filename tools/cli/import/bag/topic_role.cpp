// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/import/bag/topic_role.h"

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include <toftwin/names.h>

namespace toftwin::cli {
namespace {

using Kind = TopicRole::Kind;

constexpr std::array<std::pair<std::string_view, Kind>, 11> kTypes{{
    {"sensor_msgs/Image", Kind::Image},
    {"sensor_msgs/CompressedImage", Kind::Compressed},
    {"sensor_msgs/CameraInfo", Kind::Info},
    {"sensor_msgs/PointCloud2", Kind::Cloud},
    {"tf2_msgs/TFMessage", Kind::Transforms},
    {"tf/tfMessage", Kind::Transforms},
    {"foxglove.RawImage", Kind::Image},
    {"foxglove.CompressedImage", Kind::Compressed},
    {"foxglove.CameraCalibration", Kind::Info},
    {"foxglove.PointCloud", Kind::Cloud},
    {"foxglove.FrameTransforms", Kind::Transforms},
}};

/// What cameras' drivers call their images, beside our own words.
std::optional<PlaneKind> planeOfWord(std::string_view word) {
  constexpr std::array<std::string_view, 7> kAmplitude{"ir", "infra", "infra1", "infrared", "intensity", "gray", "confidence_amplitude"};
  constexpr std::array<std::string_view, 3> kColor{"rgb", "color", "colour"};
  if (const auto kind = planeKindNamed(word)) return kind;
  if (std::ranges::find(kAmplitude, word) != kAmplitude.end()) return PlaneKind::Amplitude;
  if (std::ranges::find(kColor, word) != kColor.end()) return PlaneKind::Color;
  return std::nullopt;
}

/// "/a/b" and "c" of "/a/b/c".
std::pair<std::string, std::string> split(const std::string& topic) {
  const std::size_t slash = topic.rfind('/');
  if (slash == topic.npos) return {"", topic};
  return {topic.substr(0, slash), topic.substr(slash + 1)};
}

}  // namespace

TopicRole roleOf(const BagTopic& topic) {
  TopicRole role;
  const auto known = std::ranges::find(kTypes, topic.type, &std::pair<std::string_view, Kind>::first);
  if (topic.dialect == Dialect::Other || known == kTypes.end()) return role;
  role.kind = known->second;
  role.is_static = topic.name.ends_with("tf_static");
  auto [space, word] = split(topic.name);
  if (role.kind == Kind::Compressed) std::tie(space, word) = split(space);  // "/a/depth/image_raw/compressedDepth"
  role.space = space;
  role.is_rectified = word.find("rect") != word.npos;
  const auto [above, last] = split(space);
  role.plane = planeOfWord(last);
  role.camera = role.plane ? above : space;
  return role;
}

std::string sourceNameOf(const std::string& camera) {
  std::string name = camera.starts_with('/') ? camera.substr(1) : camera;
  std::ranges::replace(name, '/', '_');
  return name.empty() ? "camera" : name.substr(0, 60);
}

}  // namespace toftwin::cli
