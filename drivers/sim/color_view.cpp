// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/color_view.h"

#include <algorithm>
#include <utility>

#include "sim/sensor/frame_assembly.h"

namespace toftwin::drivers::simulator {
namespace {

constexpr int kRowsPerBand = 16;

void copyRows(const Image<float>& band, int first_row, int height, Image<float>& whole) {
  if (whole.empty()) whole = Image<float>{band.width(), height};
  std::copy(band.pixels().begin(), band.pixels().end(), &whole(0, first_row));
}

/// Only what a colour camera takes: light that is not modulated.
Result<sim::Light> traceInBands(const sim::Scene& scene, sim::TraceRequest request, const std::stop_token& stop) {
  const int height = request.camera.height;
  sim::Light whole;
  for (request.region_y = 0; request.region_y < height; request.region_y += kRowsPerBand) {
    if (stop.stop_requested()) return Error{Error::Code::Stopped, "asked to stop"};
    request.region_width = request.camera.width;
    request.region_height = std::min(kRowsPerBand, height - request.region_y);
    const sim::Light band = sim::trace(scene, request);
    copyRows(band.ambient, request.region_y, height, whole.ambient);
    copyRows(band.steady, request.region_y, height, whole.steady);
  }
  return whole;
}

}  // namespace

bool ColorView::complete(const Transform<World, Camera>& pose, Duration time, std::uint64_t number,
                         const std::stop_token& stop) {
  if (color_ && number == number_ && pose == request_.world_from_camera) return true;
  color_.reset();
  number_ = number;
  request_.world_from_camera = pose;
  request_.seed = seed_ + number;
  auto color = sim::renderColor(scene_, request_, [&](const sim::Scene& scene, const sim::TraceRequest& request) {
    return traceInBands(scene.moves() ? scene.at(time) : scene, request, stop);
  });
  if (!color) return false;
  color_ = *std::move(color);
  return true;
}

Plane ColorView::over(const sim::DecodeRays& rays, const Image<float>& range_m) const {
  const Image<float> depth_in_color = sim::depthInColor(request_.lenses, rays, range_m);
  return sim::planeOf(sim::colorInDepth(request_.lenses, rays, range_m, depth_in_color, *color_));
}

}  // namespace toftwin::drivers::simulator
