// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/campaign/frame_maker.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/sensor/collect_moving.h"
#include "sim/sensor/frame_assembly.h"
#include "tools/cli/render_images.h"

namespace toftwin::cli {
namespace {

sim::TraceRequest requestFor(const sim::SensorModel& model, const drivers::simulator::Keys& keys) {
  sim::TraceRequest request = model.traceRequest();
  keys.applyTo(request);
  return request;
}

Duration durationOf(DeviceTime time) { return static_cast<double>(time.ns) * nanosecond; }

}  // namespace

FrameMaker::FrameMaker(sim::SensorModel model, const sim::Scene& scene, Trajectory trajectory,
                       const Transform<World, Camera>& pose, Schedule schedule, RenderSettings settings,
                       std::vector<PlaneKind> planes, std::string source)
    : model_(std::move(model)),
      trajectory_(std::move(trajectory)),
      pose_(pose),
      schedule_(schedule),
      settings_(std::move(settings)),
      planes_(std::move(planes)),
      source_(std::move(source)),
      view_(scene, requestFor(model_, settings_.keys), model_.interferences(scene.foreignEmitters()), motion(),
            settings_.freeze ? Duration{} : model_.rowDelay()) {}

sim::Motion FrameMaker::motion() const {
  sim::Motion motion;
  if (trajectory_.has_times) motion.keys = trajectory_.poses;
  return motion;
}

/// Puts the camera where it stands at that frame, unless it moves by itself.
void FrameMaker::place(std::uint64_t number) {
  Transform<World, Camera> pose = pose_;
  if (!trajectory_.poses.empty()) {
    const std::size_t at = trajectory_.has_times ? 0 : static_cast<std::size_t>(number);
    pose = {trajectory_.poses[at].rotation_wxyz, trajectory_.poses[at].position_m};
  }
  view_.setPose(pose);
}

Moment FrameMaker::momentOf(std::uint64_t number) const {
  const DeviceTime start = schedule_.startOf(number);
  Moment moment;
  moment.exposures = model_.exposures(start);
  // On a clock that began with the device's, so that recordings have an order in time.
  moment.received.ns = start.ns + std::llround(model_.exposureTime().in(nanosecond));
  moment.since_power_on = settings_.since_power_on_s * second + durationOf(start);
  const Temperature room = settings_.room_temperature_c * celsius;
  moment.temperatures = model_.temperatures(room, *moment.since_power_on);
  moment.temperatures.push_back({"room", room});
  moment.ambient = settings_.ambient_klx * kilolux;
  moment.world_from_camera = view_.poseAt(sim::middleOf(moment));
  return moment;
}

Frame FrameMaker::frameOf(std::uint64_t number, const Moment& moment) const {
  Frame frame;
  frame.source = source_;
  frame.sequence = number;
  frame.moment = moment;
  frame.camera = model_.camera();
  frame.provenance = sim::provenanceOf(model_, view_.scene().id(), settings_.keys.seed);
  return frame;
}

void FrameMaker::keep(const sim::Light& light) {
  truth_ = light.truth;
  if (std::ranges::count(planes_, PlaneKind::LightSigma) > 0) light_sigma_ = sim::lightSigmaOf(light);
}

/// Light for each raw exposure at its own time, where anything changes with time.
std::optional<sim::Samples> FrameMaker::gather(std::uint64_t number, const Moment& moment) {
  const std::uint64_t seed = settings_.keys.seed, noise = settings_.first_noise + number;
  const std::stop_token stop = stop_.get_token();
  if (!view_.changesWithTime()) {
    if (!view_.complete(stop)) return std::nullopt;
    keep(view_.light());
    return model_.collect(view_.light(), moment, seed, noise);
  }
  const std::size_t count = moment.exposures.size();
  return sim::collectMoving(model_, moment, seed, noise, [&](std::size_t e) -> const sim::Light* {
    const Duration time = settings_.freeze ? sim::middleOf(moment) : sim::middleOf(moment.exposures[e]);
    if (!settings_.freeze || e == 0) view_.moveTo(time, noise * count + e);
    if (!view_.complete(stop)) return nullptr;
    if (e == count / 2) keep(view_.light());
    return &view_.lightFor(moment.exposures[e]);
  });
}

Result<Frame> FrameMaker::make(std::uint64_t number, const Watch& watch) {
  place(number);
  const Moment moment = momentOf(number);
  const bool each = view_.changesWithTime() && !settings_.freeze;
  const double rows = view_.rows() * (each ? static_cast<double>(moment.exposures.size()) : 1.0);
  double done = 0.0;
  stop_ = {};
  view_.whenRowsAreTraced([&](int traced) {
    done += traced;
    if (!watch(std::min(1.0, done / rows))) stop_.request_stop();
  });
  auto collected = gather(number, moment);
  view_.whenRowsAreTraced({});
  if (!collected) return Error{Error::Code::Stopped, "interrupted"};
  const sim::History before{memory_.collected ? &*memory_.collected : nullptr,
                            memory_.range ? &*memory_.range : nullptr};
  const std::uint64_t noise = settings_.first_noise + number;
  if (!remembers()) memory_ = {};
  auto exposed = model_.readOut(*collected, moment, settings_.keys.seed, noise, 0, 0, before);
  if (remembers()) memory_ = {.collected = std::move(collected), .range = exposed.range};
  Frame frame = frameOf(number, moment);
  frame.planes = sim::planesOf(model_, std::move(exposed), truth_, planes_);
  if (light_sigma_) frame.planes.push_back(*std::move(light_sigma_));
  light_sigma_.reset();
  if (!visible_) return frame;
  auto color = colorOf(moment, number, watch);
  if (!color) return color.error();
  frame.planes.push_back(*std::move(color));
  return frame;
}

/// The world as it is when the pose is, too; its sampling noise is another in every frame.
Result<Plane> FrameMaker::colorOf(const Moment& moment, std::uint64_t number, const Watch& watch) {
  const auto trace = [&](const sim::Scene& scene, const sim::TraceRequest& request) -> Result<sim::Light> {
    if (!watch(1.0)) return Error{Error::Code::Stopped, "interrupted"};
    return sim::trace(scene.at(sim::middleOf(moment)), request);
  };
  const auto color = sim::renderColor(*visible_,
                                      {.lenses = *model_.colorLens(),
                                       .world_from_camera = *moment.world_from_camera,
                                       .samples_per_pixel = settings_.keys.samples_per_pixel,
                                       .max_surfaces = settings_.keys.max_surfaces,
                                       .seed = settings_.keys.seed + settings_.first_noise + number},
                                      trace);
  if (!color) return color.error();
  return sim::planeOf(*color);
}

Frame FrameMaker::example() {
  place(0);
  const Moment moment = momentOf(0);
  sim::TraceRequest quick = requestFor(model_, settings_.keys);
  quick.samples_per_pixel = 1;
  quick.max_surfaces = 1;
  quick.world_from_camera = *moment.world_from_camera;
  const sim::Light light = sim::trace(view_.scene(), quick);
  Frame frame = frameOf(0, moment);
  frame.planes = sim::planesOf(model_, model_.expose(light, moment, 0, 0), light.truth, planes_);
  if (std::ranges::count(planes_, PlaneKind::LightSigma) > 0)
    frame.planes.push_back(sim::lightSigmaOf(light));
  if (visible_) {
    const CameraInfo lens = model_.colorLens()->color;
    const Image<std::uint8_t> black{lens.width, lens.height};
    frame.planes.push_back(sim::planeOf({black, black, black}));
  }
  return frame;
}

}  // namespace toftwin::cli
