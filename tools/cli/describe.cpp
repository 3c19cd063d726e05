// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/describe.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cmath>
#include <ctime>

#include <toftwin/names.h>

namespace toftwin::cli {

compare::Json toJson(const CameraInfo& camera) {
  return compare::Json::object()
      .set("width", camera.width)
      .set("height", camera.height)
      .set("fx", camera.fx)
      .set("fy", camera.fy)
      .set("cx", camera.cx)
      .set("cy", camera.cy)
      .set("distortion_k1_k2_p1_p2_k3", compare::Json::arrayOf(camera.distortion))
      .set("calibration_id", camera.calibration_id);
}

std::string toText(const CameraInfo& camera) {
  constexpr double kDegrees = 180.0 / 3.14159265358979323846;
  const double right = std::atan((camera.width - 0.5 - camera.cx) / camera.fx);
  const double left = std::atan((-0.5 - camera.cx) / camera.fx);
  const double below = std::atan((camera.height - 0.5 - camera.cy) / camera.fy);
  const double above = std::atan((-0.5 - camera.cy) / camera.fy);
  return fmt::format(
      "image        {} × {} pixels, {:.1f}° × {:.1f}° without distortion\n"
      "focal length {:.6g} × {:.6g} pixels, centre ({:.6g}, {:.6g})\n"
      "distortion   k1 {:.6g}, k2 {:.6g}, p1 {:.6g}, p2 {:.6g}, k3 {:.6g}\n"
      "calibration  {}\n",
      camera.width, camera.height, (right - left) * kDegrees, (below - above) * kDegrees, camera.fx,
      camera.fy, camera.cx, camera.cy, camera.distortion[0], camera.distortion[1],
      camera.distortion[2], camera.distortion[3], camera.distortion[4],
      camera.calibration_id.empty() ? "unknown" : camera.calibration_id);
}

std::string toText(HostTime time) {
  if (time.ns <= 0) return "unknown";
  const std::time_t seconds = time.ns / 1'000'000'000;
  std::tm utc{};
  ::gmtime_r(&seconds, &utc);
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03} UTC", utc, time.ns / 1'000'000 % 1000);
}

std::string namesOf(const std::vector<PlaneKind>& planes) {
  std::string names;
  for (const PlaneKind kind : planes)
    names += (names.empty() ? "" : ", ") + std::string{nameOf(kind)};
  return names.empty() ? "none" : names;
}

std::string planesOf(const Frame& frame) {
  std::vector<PlaneKind> kinds;
  for (const Plane& plane : frame.planes) kinds.push_back(plane.kind);
  return fmt::format("{}×{} {}", frame.camera.width, frame.camera.height, namesOf(kinds));
}

}  // namespace toftwin::cli
