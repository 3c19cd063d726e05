// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/view.h"

#include <algorithm>
#include <utility>

#include "drivers/sim/light_seed.h"
#include "sim/sensor/collect_moving.h"
#include "sim/tracer/trace_bands.h"

namespace toftwin::drivers::simulator {
namespace {

constexpr int kRowsPerBand = 16;
constexpr int kRowsPerRollingBand = 4;  // which see the same time

std::vector<sim::SeenHarmonic> seenBy(const sim::SensorModel& model) {
  return model.hasPhasors() ? model.correlatedTerms() : std::vector<sim::SeenHarmonic>{};
}

}  // namespace

void View::forget() {
  own_.rows_done = 0;
  for (Pass& pass : foreign_) pass.rows_done = 0;
}

void View::setPose(const Transform<World, Camera>& world_from_camera) {
  if (world_from_camera == pose_) return;
  pose_ = request_.world_from_camera = world_from_camera;
  forget();
}

void View::setModel(const sim::SensorModel& model) {
  const std::vector<Frequency> frequencies = model.traceRequest().frequencies;
  if (frequencies == request_.frequencies && (!realtime_ || seen_ == seenBy(model))) return;
  request_.frequencies = frequencies;
  interferences_ = model.interferences(scene_.foreignEmitters());
  own_ = {};
  foreign_.assign(foreign_.size(), {});
  if (!realtime_) return;
  realtime_light_ = nullptr;
  goRealtime(model);
}

void View::moveTo(Duration time, std::uint64_t number) {
  if (!moves()) return;
  constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15u;  // 2⁶⁴ / golden ratio
  time_ = time;
  request_.seed = seed_ + (number + 1) * kGolden;
  forget();
}

void View::goRealtime(const sim::SensorModel& model) {
  realtime_.emplace();
  begun_.reset();
  seen_ = seenBy(model);
}

sim::TraceRequest View::requestAt(Duration time) const {
  sim::TraceRequest request = request_;
  request.world_from_camera = poseAt(time);
  return request;
}

void View::traceFrame(Duration time) {
  const bool is_begun = begun_ == begunAt(time);
  realtime_light_ = is_begun ? &realtime_->finish() : &realtime_->next(sceneAt(time), requestAt(time), seen_);
  begun_.reset();
}

void View::beginFrame(Duration time) {
  realtime_->begin(sceneAt(time), requestAt(time), seen_);
  begun_ = begunAt(time);
}

bool View::complete(const sim::Interference* interference, Pass& pass, const std::stop_token& stop) const {
  const int height = request_.camera.height;
  const bool is_rolling = moves() && row_delay_ > Duration{};
  sim::Scene posed = moves() ? scene_.at(time_) : scene_;
  while (pass.rows_done < height) {
    if (stop.stop_requested()) return false;
    sim::TraceRequest band = request_;
    if (!moves()) band.seed = lightSeed(seed_, pose_);
    band.region_y = pass.rows_done;
    band.region_width = request_.camera.width;
    band.region_height = std::min(is_rolling ? kRowsPerRollingBand : kRowsPerBand, height - pass.rows_done);
    const Duration time = time_ + (band.region_y + 0.5 * (band.region_height - 1)) * row_delay_;
    if (is_rolling) posed = scene_.at(time);
    if (moves()) band.world_from_camera = poseAt(is_rolling ? time : time_);
    // A tile of pixels that share their paths would be traced for each of its bands anew.
    if (is_rolling && band.sampler == sim::Sampler::Shared) band.sampler = sim::Sampler::Even;
    if (interference != nullptr) band = interference->request(band);
    sim::putBand(sim::trace(posed, band), pass.rows_done, height, pass.light);
    pass.rows_done += band.region_height;
    if (tell_) tell_(band.region_height);
  }
  return true;
}

bool View::complete(const std::stop_token& stop) {
  if (!complete(nullptr, own_, stop)) return false;
  for (std::size_t i = 0; i < foreign_.size(); ++i) {
    if (!complete(&interferences_[i], foreign_[i], stop)) return false;
  }
  return true;
}

const sim::Light& View::lightFor(const Exposure& exposure) {
  if (foreign_.empty()) return own_.light;
  mixed_ = own_.light;
  for (std::size_t i = 0; i < foreign_.size(); ++i)
    interferences_[i].addTo(mixed_, foreign_[i].light, exposure, row_delay_);
  return mixed_;
}

}  // namespace toftwin::drivers::simulator
