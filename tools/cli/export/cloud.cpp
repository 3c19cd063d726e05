// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/export/cloud.h"

#include <fmt/format.h>

#include <cmath>

#include <toftwin/names.h>
#include <toftwin/nan.h>

namespace toftwin::cli {
namespace {

Result<> checkPlane(const Frame& frame, const Plane& plane, const ExportOptions& options) {
  if (unitOf(plane.kind) != "m" || plane.kind == PlaneKind::LightSigma)
    return Error{Error::Code::InvalidArgument, fmt::format("points need range, depth or truth_range, not {}", nameOf(plane.kind))};
  if (options.world && !frame.moment.world_from_camera)
    return Error{Error::Code::Unsupported,
                 fmt::format("{} does not know its pose, so there are no world coordinates; leave out --world", frame.source)};
  return {};
}

}  // namespace

Result<Cloud> cloudOf(const Frame& frame, const ExportOptions& options) {
  const auto plane = choosePlane(frame, options.planes);
  if (!plane) return plane.error();
  if (auto checked = checkPlane(frame, **plane, options); !checked) return checked.error();
  const auto distance_m = pictureOf(**plane, 0);
  if (!distance_m) return distance_m.error();
  const Plane* amplitudes = frame.find(PlaneKind::Amplitude);
  Cloud cloud;
  cloud.has_amplitude = amplitudes != nullptr && amplitudes->width == (*plane)->width && amplitudes->height == (*plane)->height;
  const auto amplitude = cloud.has_amplitude ? pictureOf(*amplitudes, 0) : Result<Picture>{Picture{}};
  if (!amplitude) return amplitude.error();

  const auto width = static_cast<std::size_t>((*plane)->width);
  std::size_t points = 0;
  for (std::size_t i = 0; i < distance_m->values.size(); ++i) {
    const double measured = static_cast<double>(distance_m->values[i]);
    const bool is_valid = std::isfinite(measured);
    if (!is_valid && !options.organised) continue;
    Point<Camera> at{{kNaN, kNaN, kNaN}};
    if (is_valid) {
      const Direction<Camera> ray = rayThroughPixel(frame.camera, static_cast<double>(i % width), static_cast<double>(i / width));
      at.m = ray.v * ((*plane)->kind == PlaneKind::Depth ? measured / ray.v.z : measured);
      if (options.world) at.m = (*frame.moment.world_from_camera * at).m;
      ++points;
    }
    for (const double number : {at.m.x, at.m.y, at.m.z}) cloud.numbers.push_back(static_cast<float>(number));
    if (cloud.has_amplitude) cloud.numbers.push_back(amplitude->values[i]);
  }
  cloud.width = options.organised ? width : points;
  cloud.height = options.organised ? static_cast<std::size_t>((*plane)->height) : 1;
  cloud.note = options.organised ? fmt::format("{} x {} points, {} of them valid, metres", cloud.width, cloud.height, points)
                                 : fmt::format("{} points, metres", points);
  return cloud;
}

std::string titleOf(const Frame& frame) {
  std::string source = frame.source;
  for (char& c : source) c = c == '\n' || c == '\r' ? ' ' : c;
  return fmt::format("{} frame {} of {}, calibration {}", nameOf(frame.provenance.kind), frame.sequence, source,
                     frame.camera.calibration_id.empty() ? "unknown" : frame.camera.calibration_id);
}

}  // namespace toftwin::cli
