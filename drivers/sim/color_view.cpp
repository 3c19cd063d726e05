// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/color_view.h"

#include <utility>

#include "drivers/sim/light_seed.h"
#include "sim/sensor/frame_assembly.h"
#include "sim/tracer/trace_bands.h"

namespace toftwin::drivers::simulator {
bool ColorView::complete(const Transform<World, Camera>& pose, Duration time, std::uint64_t number,
                         const std::stop_token& stop) {
  if (color_ && number == number_ && pose == request_.world_from_camera) return true;
  color_.reset();
  number_ = number;
  request_.world_from_camera = pose;
  request_.seed = lightSeed(seed_, pose) + number;
  const auto trace = [&](const sim::Scene& scene, const sim::TraceRequest& request) -> Result<sim::Light> {
    auto light = sim::traceInBands(scene.moves() ? scene.at(time) : scene, request,
                                   [&](int) { return !stop.stop_requested(); });
    if (!light) return Error{Error::Code::Stopped, "asked to stop"};
    return *std::move(light);
  };
  auto color = sim::renderColor(scene_, request_, trace);
  if (!color) return false;
  color_ = *std::move(color);
  return true;
}

Plane ColorView::over(const sim::DecodeRays& rays, const Image<float>& range_m) const {
  const Image<float> depth_in_color = sim::depthInColor(request_.lenses, rays, range_m);
  return sim::planeOf(sim::colorInDepth(request_.lenses, rays, range_m, depth_in_color, *color_));
}

}  // namespace toftwin::drivers::simulator
