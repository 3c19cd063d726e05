// SPDX-License-Identifier: Apache-2.0
// PLY: the valid pixels as points, binary, metres.
#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include <toftwin/names.h>

#include "tools/cli/export/export.h"

namespace toftwin::cli {
namespace {

void append(std::vector<std::byte>& out, const void* data, std::size_t size) {
  const auto* bytes = static_cast<const std::byte*>(data);
  out.insert(out.end(), bytes, bytes + size);
}

std::string headerOf(const Frame& frame, std::size_t points, bool has_amplitude, bool world) {
  std::string source = frame.source;  // a comment is one line
  for (char& c : source) c = c == '\n' || c == '\r' ? ' ' : c;
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\n"
      "comment {} frame {} of {}, calibration {}\n"
      "comment metres in the {} frame\n"
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n{}end_header\n",
      nameOf(frame.provenance.kind), frame.sequence, source,
      frame.camera.calibration_id.empty() ? "unknown" : frame.camera.calibration_id,
      world ? "world" : "camera's (x right, y down, z along the optical axis)", points,
      has_amplitude ? "property float amplitude\n" : "");
}

}  // namespace

Result<Exported> toPly(const Frame& frame, const ExportOptions& options) {
  const auto plane = choosePlane(frame, options.planes);
  if (!plane) return plane.error();
  if (unitOf((*plane)->kind) != "m" || (*plane)->kind == PlaneKind::LightSigma) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("points need range, depth or truth_range, not {}", nameOf((*plane)->kind))};
  }
  if (options.world && !frame.moment.world_from_camera) {
    return Error{
        Error::Code::Unsupported,
        fmt::format(
            "{} does not know its pose, so there are no world coordinates; leave out --world",
            frame.source)};
  }
  const auto distance_m = pictureOf(**plane, 0);
  if (!distance_m) return distance_m.error();
  const Plane* amplitudes = frame.find(PlaneKind::Amplitude);
  const bool has_amplitude = amplitudes != nullptr && amplitudes->width == (*plane)->width &&
                             amplitudes->height == (*plane)->height;
  const auto amplitude = has_amplitude ? pictureOf(*amplitudes, 0) : Result<Picture>{Picture{}};
  if (!amplitude) return amplitude.error();

  std::vector<std::byte> vertices;
  std::size_t points = 0;
  for (std::size_t i = 0; i < distance_m->values.size(); ++i) {
    if (!std::isfinite(distance_m->values[i])) continue;
    const auto width = static_cast<std::size_t>((*plane)->width);
    const Direction<Camera> ray = rayThroughPixel(frame.camera, static_cast<double>(i % width),
                                                  static_cast<double>(i / width));
    const double measured = static_cast<double>(distance_m->values[i]);
    const double range_m = (*plane)->kind == PlaneKind::Depth ? measured / ray.v.z : measured;
    Point<Camera> at{ray.v * range_m};
    if (options.world) at.m = (*frame.moment.world_from_camera * at).m;
    const float xyz[3] = {static_cast<float>(at.m.x), static_cast<float>(at.m.y),
                          static_cast<float>(at.m.z)};
    append(vertices, xyz, sizeof xyz);
    if (has_amplitude) append(vertices, &amplitude->values[i], sizeof(float));
    ++points;
  }
  Exported exported;
  const std::string header = headerOf(frame, points, has_amplitude, options.world);
  append(exported.bytes, header.data(), header.size());
  append(exported.bytes, vertices.data(), vertices.size());
  exported.note = fmt::format("{} points, metres", points);
  return exported;
}

}  // namespace toftwin::cli
