// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/describe.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <iterator>
#include <limits>

#include <toftwin/names.h>

#include "protocol/settings/describe.h"
#include "protocol/types/counted.h"

namespace toftwin::cli {

std::string_view stateOf(const SourceEntry& source) {
  if (!source.problem.empty()) return "absent";
  return source.streaming ? "streaming" : "idle";
}

std::vector<FacadeHealthEntry> facadesOf(const DaemonHealth& health, const std::string& source) {
  std::vector<FacadeHealthEntry> those;
  std::ranges::copy_if(health.facades, std::back_inserter(those),
                       [&](const FacadeHealthEntry& one) { return one.source == source; });
  return those;
}

compare::Json toJson(const std::vector<FacadeHealthEntry>& facades) {
  compare::Json all = compare::Json::array();
  for (const FacadeHealthEntry& one : facades) {
    all.push(compare::Json::object()
                 .set("kind", one.kind)
                 .set("state", std::string{nameOf(one.state)})
                 .set("place", one.place)
                 .set("clients", one.clients ? compare::Json{*one.clients} : compare::Json{})
                 .set("problem", one.problem));
  }
  return all;
}

std::string toText(const FacadeHealthEntry& facade) {
  const std::string clients = facade.clients ? ", " + counted(*facade.clients, "client") : "";
  const std::string& more = facade.problem.empty() ? facade.place : facade.problem;
  return fmt::format("{} {}{}{}{}", facade.kind, nameOf(facade.state), clients, more.empty() ? "" : ": ",
                     more);
}

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

compare::Json toJson(const Transform<World, Camera>& world_from_camera) {
  const Vec3d& t = world_from_camera.translation_m;
  return compare::Json::object()
      .set("position_m", compare::Json::arrayOf(std::array{t.x, t.y, t.z}))
      .set("rotation_wxyz", compare::Json::arrayOf(world_from_camera.rotation_wxyz));
}

std::string toText(const Transform<World, Camera>& world_from_camera) {
  const Vec3d& t = world_from_camera.translation_m;
  const auto& [w, x, y, z] = world_from_camera.rotation_wxyz;
  const Direction<World> axis = world_from_camera * Direction<Camera>{{0.0, 0.0, 1.0}};
  // + 0.0 makes the zero of a product with a negative number positive.
  return fmt::format(
      "position     {:.6g}, {:.6g}, {:.6g} m\n"
      "rotation     {:.9g}, {:.9g}, {:.9g}, {:.9g} (quaternion w, x, y, z)\n"
      "looks along  {:.6g}, {:.6g}, {:.6g}\n",
      t.x, t.y, t.z, w, x, y, z, axis.v.x + 0.0, axis.v.y + 0.0, axis.v.z + 0.0);
}

compare::Json toJson(const std::vector<Parameter>& parameters) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();  // null
  compare::Json all = compare::Json::array();
  for (const Parameter& parameter : parameters) {
    compare::Json one = compare::Json::object();
    one.set("name", parameter.name)
        .set("value", parameter.value.value_or(kNone))
        .set("lowest", parameter.bounds.min)
        .set("highest", parameter.bounds.max);
    if (parameter.text) one.set("text", *parameter.text);
    if (!parameter.choices.empty()) {
      compare::Json choices = compare::Json::array();
      for (const std::string& choice : parameter.choices) choices.push(choice);
      one.set("choices", std::move(choices));
    }
    all.push(std::move(one));
  }
  return all;
}

std::string toText(const std::vector<Parameter>& parameters) {
  std::size_t width = 0;
  for (const Parameter& parameter : parameters) width = std::max(width, parameter.name.size());
  std::string text;
  for (const Parameter& parameter : parameters) {
    const std::string bounds = parameter.choices.empty()
                                   ? settings::describe(parameter.bounds)
                                   : fmt::format("one of {}", fmt::join(parameter.choices, ", "));
    const std::string value = parameter.text    ? *parameter.text
                              : parameter.value ? fmt::format("{:.9g}", *parameter.value)
                                                : "-";
    text += bounds.empty() ? fmt::format("  {:<{}}  {}\n", parameter.name, width, value)
                           : fmt::format("  {:<{}}  {:<12} {}\n", parameter.name, width, value,
                                         bounds);
  }
  return text;
}

std::string toText(HostTime time) {
  if (time.ns <= 0) return "unknown";
  const std::time_t seconds = time.ns / 1'000'000'000;
  std::tm utc{};
  ::gmtime_r(&seconds, &utc);
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03} UTC", utc, time.ns / 1'000'000 % 1000);
}

std::string toText(const record::ClockJump& jump) {
  const auto seconds = [](std::int64_t ns) { return 1e-9 * static_cast<double>(ns); };
  const bool is_host = jump.clock == record::Jumped::Host;
  const std::string from = is_host ? toText(HostTime{jump.from_ns}) : fmt::format("{:.3f} s", seconds(jump.from_ns));
  const std::string to = is_host ? toText(HostTime{jump.to_ns}) : fmt::format("{:.3f} s", seconds(jump.to_ns));
  return fmt::format("the {}'s clock jumped by {:+.3f} s at frame {}, from {} to {}", is_host ? "host" : "device",
                     seconds(jump.by_ns), jump.frame, from, to);
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
