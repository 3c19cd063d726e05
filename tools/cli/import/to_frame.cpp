// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/import/to_frame.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace toftwin::cli {
namespace {

Image<float> raysOf(const CameraInfo& lens) {
  Image<float> rays{lens.width, lens.height};
  for (int v = 0; v < lens.height; ++v) {
    for (int u = 0; u < lens.width; ++u) rays(u, v) = static_cast<float>(1.0 / rayThroughPixel(lens, u, v).v.z);
  }
  return rays;
}

const Plane* find(const std::vector<Plane>& planes, PlaneKind kind) {
  const auto found = std::ranges::find(planes, kind, &Plane::kind);
  return found != planes.end() && found->type == ElementType::F32 && found->channels == 1 ? &*found : nullptr;
}

/// Adds range to depth, or the other way round.
void complete(std::vector<Plane>& planes, const Image<float>& range_of_depth) {
  const Plane* range = find(planes, PlaneKind::Range);
  const Plane* depth = find(planes, PlaneKind::Depth);
  if ((range == nullptr) == (depth == nullptr)) return;
  const bool has_range = range != nullptr;
  const auto metres = (has_range ? range : depth)->as<float>();
  Image<float> other = Image<float>::unset(range_of_depth.width(), range_of_depth.height());
  for (std::size_t i = 0; i < other.size(); ++i) other[i] = has_range ? metres[i] / range_of_depth[i] : metres[i] * range_of_depth[i];
  planes.push_back(toPlane(has_range ? PlaneKind::Depth : PlaneKind::Range, std::move(other)));
}

/// For images alone, which may be those with which a lens is to be found.
CameraInfo guessedLens(int width, int height) {
  return {.width = width, .height = height, .fx = static_cast<double>(width), .fy = static_cast<double>(width), .cx = 0.5 * (width - 1),
          .cy = 0.5 * (height - 1), .distortion = {}, .calibration_id = {}};
}

}  // namespace

Result<CameraInfo> ToFrame::lensOf(const ImportedFrame& imported) const {
  const Plane& first = imported.planes.front();
  const bool has_distances = find(imported.planes, PlaneKind::Range) != nullptr || find(imported.planes, PlaneKind::Depth) != nullptr;
  if (!lens_ && !imported.lens && !has_distances) return guessedLens(first.width, first.height);
  if (!lens_ && !imported.lens)
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: its frames of {} x {} pixels have no lens: --pinhole FX,FY,CX,CY, or --lens with a preset, a camera "
                             "file, a calibration, or one of ROS or OpenCV", what_, first.width, first.height)};
  CameraInfo lens = lens_ ? *lens_ : *imported.lens;
  if (lens.width == 0) {
    lens.width = first.width;
    lens.height = first.height;
  }
  if (lens.width == first.width && lens.height == first.height) return lens;
  return Error{Error::Code::InvalidArgument, fmt::format("{}: its frames have {} x {} pixels, but the lens has {} x {}", what_, first.width,
                                                         first.height, lens.width, lens.height)};
}

Result<> ToFrame::useLens(const ImportedFrame& imported, Source& source, const std::string& name) {
  auto lens = lensOf(imported);
  if (!lens) return lens.error();
  if (source.lens == *lens) return {};
  if (!lens_ && !imported.lens)
    notes_.push_back(fmt::format("{}: a lens of f = {:g} px is assumed, as none is known; toftwin calibrate finds it of images of a board", name, lens->fx));
  source.lens = *std::move(lens);
  source.range_of_depth = raysOf(source.lens);
  return {};
}

Result<Frame> ToFrame::make(ImportedFrame imported, const std::string& name) {
  Source& source = sources_[name];
  if (imported.planes.empty()) return Error{Error::Code::Malformed, fmt::format("{}: frame {} has no pixels", what_, source.frames)};
  const Plane& first = imported.planes.front();
  if (source.frames > 0 && (first.width != source.lens.width || first.height != source.lens.height)) {
    return Error{Error::Code::InvalidArgument, fmt::format("{}: frame {} has {} x {} pixels, those before have {} x {}", what_, source.frames,
                                                           first.width, first.height, source.lens.width, source.lens.height)};
  }
  if (auto used = useLens(imported, source, name); !used) return used.error();
  Frame frame;
  frame.source = name;
  frame.sequence = source.frames++;
  frame.camera = source.lens;
  frame.provenance.kind = FrameKind::Real;
  const std::int64_t counted_ns = std::llround(static_cast<double>(frame.sequence) / rate_hz_ * 1e9);
  const std::int64_t time_ns = imported.time_ns.value_or(counted_ns);
  frame.moment.exposures = {{.start = {time_ns}, .duration = {}, .modulation = {}}};
  frame.moment.received.ns = imported.received_ns.value_or(time_ns);
  frame.moment.world_from_camera = imported.world_from_camera;
  frame.planes = std::move(imported.planes);
  complete(frame.planes, source.range_of_depth);
  return frame;
}

}  // namespace toftwin::cli
