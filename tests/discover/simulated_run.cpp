// SPDX-License-Identifier: Apache-2.0
#include "tests/discover/simulated_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "calib/plan/captures.h"
#include "calib/plan/run_index.h"
#include "drivers/sim/light_seed.h"
#include "protocol/record/recording.h"
#include "sim/sensor/frame_assembly.h"
#include "sim/tracer/trace.h"

namespace toftwin::discover {
namespace {

template <class T>
T orThrow(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return *std::move(result);
}
void orThrow(const Result<>& result) {
  if (!result) throw std::runtime_error(result.error().message);
}

using Engine = std::mt19937_64;

double normal(Engine& engine) { return std::normal_distribution<double>{}(engine); }

Transform<World, Camera> bumped(const Transform<World, Camera>& pose, const SimulatedRun& run,
                                double times, Engine& engine) {
  const double turn = times * run.pose_error_deg * std::numbers::pi / 180.0;
  Transform<Camera, Camera> by = rotation<Camera, Camera>({1, 0, 0}, turn * normal(engine)) *
                                 rotation<Camera, Camera>({0, 1, 0}, turn * normal(engine));
  by.translation_m = times * run.pose_error_m * Vec3d{normal(engine), normal(engine), normal(engine)};
  return pose * by;
}

void brighten(sim::Light& light, float factor) {
  for (auto& phasors : light.phasors) {
    for (auto& phasor : phasors.pixels()) phasor *= factor;
  }
  for (float& steady : light.steady.pixels()) steady *= factor;
}

Moment momentOf(const sim::SensorModel& camera, const plan::PlannedCapture& planned,
                const std::optional<Transform<World, Camera>>& pose, std::uint64_t frame) {
  Moment moment;
  const Duration since = planned.start + static_cast<double>(frame) * camera.frameInterval();
  moment.exposures = camera.exposures({static_cast<std::int64_t>(since.in(nanosecond))});
  moment.since_power_on = since;
  moment.temperatures = camera.temperatures(23_degC, since);
  moment.temperatures.push_back({"room", 23_degC});
  moment.ambient = planned.ambient;
  moment.world_from_camera = pose;
  return moment;
}

/// The frames of one capture; the world's pose is not quite the one that they name.
plan::RecordedFile capture(const SimulatedRun& run, const plan::PlannedCapture& planned,
                           const std::filesystem::path& folder, plan::Taken& taken) {
  Engine engine{run.seed * 1'000'003 + planned.number};
  sim::SensorModel camera = run.camera;
  if (planned.exposure > Duration{})
    camera = orThrow(camera.with("exposure_us", planned.exposure.in(microsecond)));
  const std::string block = run.plan.blocks[planned.block].name;
  const auto other = run.scene_of_block.find(block);
  sim::TraceRequest request = camera.traceRequest();
  const auto pose = planned.pose->world_from_camera();
  const bool is_bumped = std::ranges::find(run.bumped, static_cast<int>(planned.number)) != run.bumped.end();
  request.world_from_camera = bumped(pose, run, is_bumped ? 10.0 : 1.0, engine);
  request.world_from_camera.translation_m =
      request.world_from_camera.translation_m + 1e-3 * run.rig_mm_per_m * pose.translation_m;
  request.samples_per_pixel = 128;
  request.max_surfaces = run.max_surfaces;
  request.seed = engine();
  if (run.shared_paths > 0) {
    request.samples_per_pixel = run.shared_paths, request.sampler = sim::Sampler::Shared;
    request.seed = drivers::simulator::lightSeed(run.seed, pose);
  }
  sim::Light light = sim::trace(other == run.scene_of_block.end() ? run.scene : other->second, request);
  brighten(light, static_cast<float>(std::exp(run.light_error * normal(engine))));
  const std::string name = fmt::format(
      "{}/{:04}-a.mcap", planned.is_locked ? plan::kLockedFolder : plan::kOpenFolder, planned.number);
  auto writer = orThrow(record::Writer::create(folder / name, {.overwrite = true}));
  std::vector kinds{PlaneKind::Range, PlaneKind::Amplitude, PlaneKind::Flags};
  if (run.with_samples) kinds.push_back(PlaneKind::Samples);
  sim::Samples before_collected;
  sim::RangeImage before_range;
  const int frames = run.frames > 0 ? run.frames : planned.frames;
  for (int k = 0; k < frames; ++k) {
    const std::uint64_t number = planned.number * 1000 + static_cast<std::uint64_t>(k);
    Frame frame;
    frame.source = "cam", frame.sequence = number, frame.camera = camera.camera();
    frame.moment = momentOf(camera, planned, run.with_poses ? std::optional{pose} : std::nullopt,
                            static_cast<std::uint64_t>(k));
    sim::Samples collected = camera.collect(light, frame.moment, run.seed, number);
    const sim::History history = k == 0 ? sim::History{} : sim::History{&before_collected, &before_range};
    auto exposed = camera.readOut(collected, frame.moment, run.seed, number, 0, 0, history);
    before_collected = std::move(collected), before_range = exposed.range;
    if (run.spoil) run.spoil(exposed.range, frame.moment, camera.camera(), static_cast<std::uint64_t>(k));
    if (k == 0) taken.a.exposure = frame.moment.exposures.front().duration;
    frame.planes = sim::planesOf(camera, std::move(exposed), light.truth, kinds);
    if (run.shared_paths > 0) frame.planes.push_back(sim::lightSigmaOf(light));
    orThrow(writer.write(frame));
  }
  orThrow(writer.close());
  if (run.with_poses) taken.pose = pose;
  return {name, orThrow(plan::sha256Of(folder / name)), "cam", static_cast<std::uint64_t>(frames),
          planned.start.in(second)};
}

}  // namespace

void write(const SimulatedRun& run, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / plan::kOpenFolder);
  std::filesystem::create_directories(folder / plan::kLockedFolder);
  const auto schedule = orThrow(plan::scheduleOf(run.plan));
  std::ofstream index{folder / plan::kIndexFile};
  for (const plan::PlannedCapture& planned : schedule.captures) {
    plan::Taken taken;
    const plan::RecordedFile file = capture(run, planned, folder, taken);
    index << plan::lineOf(run.plan, planned, taken, file, file) << "\n";
  }
}

std::string withReplaced(std::string text, std::initializer_list<std::pair<std::string_view, std::string>> parts) {
  for (const auto& [old, by] : parts) {
    const auto at = text.find(old);
    if (at == std::string::npos) throw std::runtime_error(fmt::format("no \"{}\" in: {}", old, text));
    text.replace(at, old.size(), by);
  }
  return text;
}

std::string smallCamera(const std::string& effects) {
  return R"(model = "small"
[lens]
width = 44
height = 33
fx = 42.0
fy = 42.0
cx = 21.5
cy = 16.0
[[emitter]]
power_w = 30.0
half_angle_deg = 60.0
[[modulation]]
frequency_mhz = 30.0
contrast = 0.5
exposure_us = 500.0
[sampling]
steps = 4
taps = 2
frame_interval_ms = 50.0
[thermal]
illumination_rise_c = 20.0
illumination_time_s = 300.0
sensor_rise_c = 12.0
sensor_time_s = 900.0
[pixel]
electrons_per_radiance_s = 3e8
[decoder]
farthest_m = 4.9
[[effect]]
type = "ambient_light"
[[effect]]
type = "shot_noise"
[[effect]]
type = "read_noise"
sigma_electrons = 30.0
)" + effects;
}

std::string tinyCamera(const std::string& effects) {
  return withReplaced(smallCamera(effects),
                      {{"width = 44", "width = 28"}, {"height = 33", "height = 21"}, {"fx = 42.0", "fx = 26.7"},
                       {"fy = 42.0", "fy = 26.7"}, {"cx = 21.5", "cx = 13.5"}, {"cy = 16.0", "cy = 10.0"}});
}

std::string smallScene() {
  return R"(
[[material]]
name = "grey"
albedo = 0.5
[[material]]
name = "white"
albedo = 0.9
[[material]]
name = "dark"
albedo = 0.12
[[object]]
name = "wall"
shape = "rectangle"
size_m = [9, 7, 0]
position_m = [0, 0, 2]
material = "grey"
[[object]]
name = "plate"
shape = "rectangle"
size_m = [0.35, 1.2, 0]
position_m = [0.4, 0.0, 1.75]
material = "white"
[[object]]
name = "strip"
shape = "rectangle"
size_m = [0.3, 1.2, 0]
position_m = [-0.45, 0.0, 1.98]
material = "dark"
)";
}

std::string cornerScene() {
  return R"(
[[material]]
name = "paint"
albedo = 0.8
[[object]]
name = "right board"
shape = "rectangle"
size_m = [3.0, 3.0, 0.0]
position_m = [1.06066017, 0.0, 0.93933983]
euler_deg = [0.0, 45.0, 0.0]
material = "paint"
[[object]]
name = "left board"
shape = "rectangle"
size_m = [3.0, 3.0, 0.0]
position_m = [-1.06066017, 0.0, 0.93933983]
euler_deg = [0.0, 135.0, 0.0]
material = "paint"
)";
}

std::string cornerPlan() {
  return R"(name = "corner"
seed = 7
frames = 8
exposure_us = 500.0
[[block]]
name = "distance"
kind = "distance"
distance_m = [1.0, 1.2, 1.4, 1.6, 1.8]
repeats = 2
)";
}

std::string smallPlan() {
  return R"(name = "small"
seed = 7
frames = 8
exposure_us = 500.0
[[block]]
name = "warm-up"
kind = "warm_up"
distance_m = [1.5]
repeats = 14
interval_s = 80.0
[[block]]
name = "distance"
kind = "distance"
distance_m = [0.9, 1.1, 1.35, 1.6, 1.9, 2.3, 2.8, 3.3]
repeats = 2
locked = 2
[[block]]
name = "exposure"
kind = "exposure"
distance_m = [1.2, 2.2]
exposure_us = [125.0, 250.0, 750.0]
repeats = 2
locked = 1
[[block]]
name = "ambient"
kind = "ambient"
distance_m = [1.4]
ambient_klx = [0.0, 10.0, 40.0]
[[block]]
name = "tilt"
kind = "tilt"
distance_m = [1.5]
angle_deg = [-40.0, -20.0, 20.0, 40.0]
locked = 1
[[block]]
name = "judge"
kind = "locked"
distance_m = [1.0, 2.0, 3.0]
)";
}

}  // namespace toftwin::discover
