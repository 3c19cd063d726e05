// SPDX-License-Identifier: Apache-2.0
#include "protocol/ros/of_frame.h"

#include <algorithm>
#include <limits>

#include <toftwin/names.h>

namespace toftwin::ros {

Time timeOf(std::int64_t ns) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  const std::int64_t rest_ns = (ns % kSecond_ns + kSecond_ns) % kSecond_ns;
  const std::int64_t whole = ns / kSecond_ns - (ns % kSecond_ns < 0 ? 1 : 0);
  const std::int64_t seconds = std::clamp<std::int64_t>(whole, std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max());
  return {static_cast<std::int32_t>(seconds), static_cast<std::uint32_t>(rest_ns)};
}

CameraInfo infoOf(const toftwin::CameraInfo& camera) {
  CameraInfo info;
  info.height = static_cast<std::uint32_t>(camera.height);
  info.width = static_cast<std::uint32_t>(camera.width);
  info.distortion_model = "plumb_bob";
  info.d = {camera.distortion.begin(), camera.distortion.end()};
  info.k = {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
  info.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.p = {camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0};
  return info;
}

Image imageOf(const Header& header, const Pixels& pixels) {
  Image image;
  image.header = header;
  image.height = pixels.height;
  image.width = pixels.width;
  image.encoding = pixels.encoding;
  image.step = pixels.width * pixels.bytes_per_pixel;
  image.data = std::as_bytes(std::span{pixels.data});
  return image;
}

PointCloud2 cloudOf(const Header& header, const Points& points) {
  constexpr std::uint32_t kFloatSize = 4;
  PointCloud2 cloud;
  cloud.header = header;
  cloud.height = points.height;
  cloud.width = points.width;
  for (const std::string_view name : points.fields)
    cloud.fields.push_back({std::string{name}, static_cast<std::uint32_t>(cloud.fields.size()) * kFloatSize, kFloat32, 1});
  cloud.point_step = static_cast<std::uint32_t>(points.fields.size()) * kFloatSize;
  cloud.row_step = cloud.point_step * points.width;
  cloud.data = std::as_bytes(std::span{points.data});
  return cloud;
}

TransformStamped transformOf(const Header& header, const std::string& child, const toftwin::Transform<World, Camera>& world_from_camera) {
  const auto& [w, x, y, z] = world_from_camera.rotation_wxyz;
  const Vec3d& t = world_from_camera.translation_m;
  return {header, child, {{t.x, t.y, t.z}, {x, y, z, w}}};
}

std::vector<NamedPixels> imagesOf(const Frame& frame, const Rays& rays, DepthFormat format, const std::vector<PlaneKind>& wanted) {
  const auto isWanted = [&](PlaneKind kind) { return wanted.empty() || std::ranges::find(wanted, kind) != wanted.end(); };
  std::vector<NamedPixels> images;
  if (isWanted(PlaneKind::Depth)) {
    if (auto depth = depthOf(frame, rays, format)) images.push_back({std::string{nameOf(PlaneKind::Depth)}, *std::move(depth)});
  }
  for (const Plane& plane : frame.planes) {
    if (!isWanted(plane.kind) || plane.data.size() != plane.byteSize() || plane.data.size() == 0) continue;
    const std::string name{nameOf(plane.kind)};
    if (std::ranges::find(images, name, &NamedPixels::name) == images.end()) images.push_back({name, pixelsOf(plane)});
  }
  return images;
}

std::string nameFor(std::string_view source) {
  std::string name{source};
  for (char& c : name) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    if (!is_plain) c = '_';
  }
  return name.empty() || (name[0] >= '0' && name[0] <= '9') ? "camera_" + name : name;
}

}  // namespace toftwin::ros
