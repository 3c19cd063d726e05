// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/modbus/frame_facts.h"

#include <algorithm>
#include <cmath>

#include "daemon/facades/frame_views.h"

namespace toftwin::daemon::modbus {
namespace {

void addRanges(FrameFacts& facts, const CameraInfo& camera, const std::vector<float>& range_m) {
  if (range_m.empty()) return;
  std::size_t valid = 0;
  for (const float one : range_m) {
    if (!std::isfinite(one)) continue;
    ++valid;
    facts.nearest_m = std::fmin(facts.nearest_m, static_cast<double>(one));
  }
  facts.valid = static_cast<double>(valid) / static_cast<double>(range_m.size());
  const auto centre = static_cast<std::size_t>(camera.height / 2) * static_cast<std::size_t>(camera.width) +
                      static_cast<std::size_t>(camera.width / 2);
  facts.centre_m = static_cast<double>(range_m[centre]);
}

void addTemperatures(FrameFacts& facts, const Moment& moment) {
  for (const NamedTemperature& one : moment.temperatures) {
    const double value_c = one.value.in(celsius);
    if (one.where == "illumination") facts.illumination_c = value_c;
    if (one.where == "sensor") facts.sensor_c = value_c;
    if (one.where == "housing") facts.housing_c = value_c;
    if (one.where == "room") facts.room_c = value_c;
  }
}

}  // namespace

FrameFacts FrameWatch::factsOf(const Frame& frame) {
  FrameFacts facts;
  facts.came = std::chrono::steady_clock::now();
  addTemperatures(facts, frame.moment);
  if (frame.moment.since_power_on) facts.powered_on_s = frame.moment.since_power_on->in(second);
  if (!frame.moment.exposures.empty())
    facts.device_ns = std::max<std::int64_t>(0, frame.moment.exposures[0].start.ns);
  addRanges(facts, frame.camera, rangesOf(frame));
  return facts;
}

std::vector<float> FrameWatch::rangesOf(const Frame& frame) {
  if (const Plane* range = planeOf(frame, PlaneKind::Range, ElementType::F32)) {
    const auto range_m = range->as<float>();
    return {range_m.begin(), range_m.end()};
  }
  const Plane* depth = planeOf(frame, PlaneKind::Depth, ElementType::F32);
  if (depth == nullptr) return {};
  if (!rays_ || rays_->camera != frame.camera) rays_ = Rays{frame.camera, unitVectorsOf(frame.camera)};
  const auto depth_m = depth->as<float>();
  std::vector<float> range_m(depth_m.size());
  for (std::size_t i = 0; i < range_m.size(); ++i) {
    const auto z = static_cast<double>(rays_->unit_vectors[3 * i + 2]);
    range_m[i] = static_cast<float>(static_cast<double>(depth_m[i]) / z);
  }
  return range_m;
}

}  // namespace toftwin::daemon::modbus
