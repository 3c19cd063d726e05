// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/simulator.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "drivers/logging.h"
#include "drivers/loss_reasons.h"
#include "drivers/sim/chosen.h"
#include "drivers/sim/long_slices.h"
#include "drivers/sim/operating.h"
#include "drivers/sim/view.h"
#include "protocol/settings/describe.h"
#include "sim/images/rows.h"
#include "sim/sensor/collect_moving.h"
#include "sim/sensor/frame_assembly.h"
#include "sim/sensor/lens_off_axis.h"
#include "sim/sensor/sensor_model.h"
#include "sim/tracer/missing_light.h"
#include "sim/tracer/objects.h"

namespace toftwin::drivers::simulator {
namespace {

constexpr std::string_view kAmbient = "ambient_klx", kSincePowerOn = "since_power_on_s",
                           kTemperature = "room_temperature_c", kFrameRate = "frame_rate_hz",
                           kTriggered = "triggered";
constexpr Bounds kAmbientBounds_klx{0.0, 200.0}, kSincePowerOnBounds_s{0.0, 1e9},
    kTemperatureBounds_c{-40.0, 100.0}, kFrameRateBounds_hz{0.001, 1000.0}, kTriggeredBounds{0.0, 1.0};

Transform<World, Camera> startPose(const Keys& keys) {
  constexpr double kToRadian = degree.in_si;
  const auto& [x, y, z] = keys.euler_deg;
  Transform<World, Camera> pose = rotation<World, World>({0, 0, 1}, z * kToRadian) *
                                  (rotation<World, World>({0, 1, 0}, y * kToRadian) *
                                   rotation<World, Camera>({1, 0, 0}, x * kToRadian));
  pose.translation_m = {keys.position_m[0], keys.position_m[1], keys.position_m[2]};
  return pose;
}

sim::Motion motionOf(const Keys& keys) {
  const auto& [vx, vy, vz] = keys.velocity_m_per_s;
  const auto& [x, y, z] = keys.rotation_rate_deg_per_s;
  sim::Motion motion;
  motion.velocity_m_per_s = {vx, vy, vz};
  motion.rotation_rad_per_s = Vec3d{x, y, z} * degree.in_si;
  return motion;
}

SourceInfo describe(const Keys& keys, const sim::SensorModel& model,
                    std::vector<PlaneKind> planes) {
  SourceInfo info;
  info.driver = "sim";
  info.model = model.model();
  info.serial = fmt::format("sim-{}-{}", model.id().substr(0, 8), keys.seed);
  info.kind = FrameKind::Simulated;
  info.camera = model.camera();
  info.planes = std::move(planes);
  info.frame_interval = keys.frame_interval > 0_ms ? keys.frame_interval : model.frameInterval();
  info.can_set_pose = true;
  info.can_trigger = keys.pace == Pace::Trigger;
  info.can_lockstep = true;
  info.parameters = model.parameterNames();
  for (std::string_view name : {kAmbient, kSincePowerOn, kTemperature, kFrameRate, kTriggered})
    info.parameters.emplace_back(name);
  for (const Parameter& one : Operating::of(model).parameters(model)) info.parameters.push_back(one.name);
  return info;
}

/// One thread calls everything here (source.h), so nothing is locked.
class SimulatedSource final : public Source {
 public:
  SimulatedSource(Chosen chosen, View view)
      : keys_(std::move(chosen.keys)),
        base_(std::move(chosen.model)),
        model_(base_),
        operating_(Operating::of(base_)),
        planes_(std::move(chosen.planes)),
        info_(describe(keys_, model_, planesNow())),
        view_(std::move(view)),
        color_(std::move(chosen.color)),
        pacer_(keys_.pace, *info_.frame_interval),
        since_power_on_(keys_.powered_on_before),
        room_temperature_(keys_.room_temperature),
        ambient_(keys_.ambient) {
    view_.setPose(startPose(keys_));
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  Result<> start() override {
    takeLongSlices();
    pacer_.restart();
    made_ = 0;
    last_collected_.reset();
    last_range_.reset();
    filters_.forget();
    frames_as_they_are_ = 0;
    return {};
  }
  void stop() override {}

  Result<Frame> next(std::stop_token stop, bool lockstep) override {
    if (keys_.frames > 0 && made_ == keys_.frames) {
      return Error{Error::Code::EndOfStream,
                   fmt::format("the simulation ended after {} frames, as configured", made_)};
    }
    const Error stopped{Error::Code::Stopped, "asked to stop"};
    // Light first: after a new pose it takes long, and the pace then counts what a camera would
    // have delivered meanwhile as lost.
    if (!view_.isRealtime() && !view_.changesWithTime() && !(view_.complete(stop) && completeColor(stop)))
      return stopped;
    Frame frame;
    const auto lost = pacer_.waitForTurn(stop, lockstep);
    if (!lost) return lost.error();
    addLost(frame, *lost, kNotInTime);
    frame.moment = momentOfFrame();
    if (view_.isRealtime()) {
      gatherInRealtime(frame.moment);
    } else if (view_.changesWithTime() && !(gatherMoving(frame.moment, stop) && completeColor(stop))) {
      return stopped;
    }
    frame.provenance = sim::provenanceOf(model_, view_.scene().id(), keys_.seed);
    operating_.note(frame.provenance);
    frame.camera = info_.camera;
    if (isNextBegunAhead(lockstep)) {
      const Duration next = sim::middleOf(momentAt(pacer_.chooseNext()));
      sim::together([&] { frame.planes = expose(frame.moment); }, [&] { view_.beginFrame(next); });
    } else {
      frame.planes = expose(frame.moment);
    }
    pacer_.advance();
    ++made_;
    return frame;
  }

  [[nodiscard]] SourceState state() const override {
    SourceState state{model_.parameters(), view_.pose()};
    // Of several exposures it is the longest that is set.
    Parameter& exposure = state.parameters.front();
    if (!exposure.value) exposure.value = longestOf(model_.exposures({}));
    state.parameters.push_back({std::string{kAmbient}, ambient_.in(kilolux), kAmbientBounds_klx});
    // Goes on by itself; every frame says it.
    state.parameters.push_back({std::string{kSincePowerOn}, {}, kSincePowerOnBounds_s});
    state.parameters.push_back(
        {std::string{kTemperature}, room_temperature_.in(celsius), kTemperatureBounds_c});
    state.parameters.push_back(
        {std::string{kFrameRate}, 1.0 / info_.frame_interval->in(second), kFrameRateBounds_hz});
    state.parameters.push_back({std::string{kTriggered}, info_.can_trigger ? 1.0 : 0.0, kTriggeredBounds});
    for (Parameter& one : operating_.parameters(base_)) state.parameters.push_back(std::move(one));
    return state;
  }

  Result<> setPose(const Transform<World, Camera>& world_from_camera) override {
    if (auto fits = checkPose(world_from_camera); !fits) return fits;
    const Vec3d& t = world_from_camera.translation_m;
    if (std::abs(t.x) > kMostPosition_m || std::abs(t.y) > kMostPosition_m ||
        std::abs(t.z) > kMostPosition_m) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("a position of ({}, {}, {}) m is out of bounds: each must be {} to {}",
                               t.x, t.y, t.z, -kMostPosition_m, kMostPosition_m)};
    }
    if (world_from_camera == view_.pose()) return {};
    view_.setPose(world_from_camera);
    frames_as_they_are_ = 0;
    collected_.reset();
    return {};
  }

  Result<> setParameter(std::string_view name, double value) override {
    if (name == kAmbient) return set(ambient_, value, kAmbientBounds_klx, kilolux, name);
    if (name == kTemperature)
      return set(room_temperature_, value, kTemperatureBounds_c, celsius, name);
    if (name == kSincePowerOn) {
      Duration now;
      if (auto done = set(now, value, kSincePowerOnBounds_s, second, name); !done) return done;
      since_power_on_ = now - deviceDuration();
      return {};
    }
    if (name == kFrameRate) return setFrameRate(value);
    if (name == kTriggered) return setTriggered(value);
    auto operating = operating_.with(base_, name, value);
    if (operating) return change(base_, *std::move(operating));
    if (operating.error().code != Error::Code::NotFound) return operating.error();
    auto changed = base_.with(name, value);
    if (!changed) {
      return changed.error().code != Error::Code::NotFound
                 ? changed.error()
                 : Error{Error::Code::NotFound,
                         fmt::format("this camera has no parameter \"{}\"; it has: {}", name,
                                     fmt::join(info_.parameters, ", "))};
    }
    return change(*std::move(changed), operating_);
  }

  Result<> trigger() override {
    if (!info_.can_trigger) return Source::trigger();
    pacer_.trigger();
    return {};
  }

 private:
  template <class D>
  Result<> set(Quantity<D>& quantity, double value, Bounds bounds, Unit<D> unit,
               std::string_view name) {
    if (std::isnan(value) || !bounds.contains(value)) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("{} = {} {} is out of bounds: it must be {} {}", name, value,
                               unit.suffix, settings::describe(bounds), unit.suffix)};
    }
    quantity = value * unit;
    collected_.reset();
    return {};
  }

  static double longestOf(const std::vector<Exposure>& exposures) {
    double longest_us = 0.0;
    for (const Exposure& one : exposures) longest_us = std::max(longest_us, one.duration.in(microsecond));
    return longest_us;
  }

  /// Another model, or the same run otherwise. What remembers begins anew.
  Result<> change(sim::SensorModel base, Operating operating) {
    sim::SensorModel changed = operating.apply(base);
    if (auto fits = exposuresFit(changed, *info_.frame_interval); !fits) return fits;
    if (operating.operation != operating_.operation) {
      last_collected_.reset();
      last_range_.reset();
    }
    if (operating.filters != operating_.filters) filters_.forget();
    base_ = std::move(base);
    model_ = std::move(changed);
    operating_ = std::move(operating);
    view_.setModel(model_);
    info_.planes = planesNow();
    collected_.reset();
    frames_as_they_are_ = 0;
    return {};
  }

  Result<> setFrameRate(double value_hz) {
    Frequency rate;
    if (auto within = set(rate, value_hz, kFrameRateBounds_hz, hertz, kFrameRate); !within) return within;
    const Duration interval = (1.0 / value_hz) * second;
    if (auto fits = exposuresFit(model_, interval); !fits) return fits;
    pacer_.setInterval(interval);
    info_.frame_interval = interval;
    return {};
  }

  /// 1: a frame per trigger; 0: at the pace of the configuration, or in real time if that was the trigger's.
  Result<> setTriggered(double value) {
    if (value != 0.0 && value != 1.0) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("{} = {} is out of bounds: it must be 0 (free run) or 1 (by trigger)", kTriggered, value)};
    }
    const bool is_wanted = value == 1.0;
    if (is_wanted == info_.can_trigger) return {};
    pacer_.setPace(is_wanted ? Pace::Trigger : keys_.pace == Pace::Trigger ? Pace::RealTime : keys_.pace);
    info_.can_trigger = is_wanted;
    return {};
  }

  /// The colour image, where one is given, is of the middle of the frame. False if asked to stop before the end.
  bool completeColor(const std::stop_token& stop) {
    if (!color_) return true;
    const Duration middle = sim::middleOf(momentOfFrame());
    return color_->complete(view_.poseAt(middle), middle, view_.changesWithTime() ? pacer_.index() : 0, stop);
  }

  /// In real time a frame's light is begun while the one before is still exposed, once pose and exposures have stayed for a
  /// while: what is set after that makes it of no use.
  bool isNextBegunAhead(bool lockstep) {
    constexpr int kLong = 15;
    if (!view_.worksAhead() || lockstep || info_.can_trigger || made_ + 1 == keys_.frames) return false;
    frames_as_they_are_ = std::min(frames_as_they_are_ + 1, kLong + 1);
    return frames_as_they_are_ > kLong;
  }

  /// One light for all raw exposures, of the time of the middle one.
  void gatherInRealtime(const Moment& moment) {
    view_.traceFrame(sim::middleOf(moment));
    if (model_.remembers()) collected_ = model_.collect(view_.light(), moment, keys_.seed, pacer_.index());
  }

  /// Where things move or other cameras shine: light for each raw exposure at its own time. False if asked to stop before the end.
  bool gatherMoving(const Moment& moment, const std::stop_token& stop) {
    const std::size_t count = moment.exposures.size();
    collected_ = sim::collectMoving(model_, moment, keys_.seed, pacer_.index(), [&](std::size_t e) -> const sim::Light* {
      view_.moveTo(sim::middleOf(moment.exposures[e]), pacer_.index() * count + e);
      if (!view_.complete(stop)) return nullptr;
      if (e == count / 2) keepOfMiddle(view_.light());
      return &view_.lightFor(moment.exposures[e]);
    });
    return collected_.has_value();
  }

  /// The planes of the next frame: the light of the pose with this frame's noise.
  std::vector<Plane> expose(const Moment& moment) {
    if (!view_.isRealtime() && !view_.changesWithTime() && (!collected_ || !model_.collectsTheSameEachFrame())) {
      collected_ = model_.collect(view_.light(), moment, keys_.seed, pacer_.index());
    }
    const sim::History before{last_collected_ ? &*last_collected_ : nullptr,
                              last_range_ ? &*last_range_ : nullptr};
    // In real time light is new in each frame, and samples free of noise are kept only for what remembers
    // them.
    auto exposed = view_.isRealtime() && !model_.remembers()
                       ? exposeInRealtime(moment)
                       : model_.readOut(*collected_, moment, keys_.seed, pacer_.index(), 0, 0, before);
    if (model_.remembers()) {
      last_collected_ = *collected_;
      last_range_ = exposed.range;
    }
    filters_.apply(operating_.filters, exposed.range);
    std::optional<Plane> color;
    if (color_) color = color_->over(model_.rays(), exposed.range.range_m);
    const bool is_of_middle = !view_.isRealtime() && view_.changesWithTime();
    auto planes = sim::planesOf(model_, std::move(exposed),
                                is_of_middle ? truth_of_middle_ : view_.light().truth, info_.planes);
    if (color) planes.push_back(*std::move(color));
    if (wantsLightSigma())
      planes.push_back(is_of_middle ? *sigma_of_middle_ : sim::lightSigmaOf(view_.light()));
    return planes;
  }

  /// Samples only if somebody looks at them.
  [[nodiscard]] sim::SensorModel::Exposed exposeInRealtime(const Moment& moment) const {
    if (std::ranges::count(info_.planes, PlaneKind::Samples) > 0)
      return model_.expose(view_.light(), moment, keys_.seed, pacer_.index());
    return {{}, model_.measure(view_.light(), moment, keys_.seed, pacer_.index())};
  }

  [[nodiscard]] bool wantsLightSigma() const {
    return std::ranges::count(planes_, PlaneKind::LightSigma) > 0;
  }

  /// What is said of the light, not made of it, is that of the middle raw exposure.
  void keepOfMiddle(const sim::Light& light) {
    truth_of_middle_ = light.truth;
    if (wantsLightSigma()) sigma_of_middle_ = sim::lightSigmaOf(light);
  }

  /// Those of the configuration, and if it names none, which exposure was taken where there are several by now.
  [[nodiscard]] std::vector<PlaneKind> planesNow() const {
    std::vector<PlaneKind> planes = planes_;
    const auto exposure = std::ranges::find(planes, PlaneKind::Exposure);
    if (model_.exposureCount() == 1 && exposure != planes.end()) planes.erase(exposure);
    if (model_.exposureCount() > 1 && base_.exposureCount() == 1 && keys_.planes.empty())
      planes.push_back(PlaneKind::Exposure);
    return planes;
  }

  [[nodiscard]] Duration deviceDuration() const {
    return static_cast<double>(pacer_.deviceTime().ns) * nanosecond;
  }

  [[nodiscard]] Moment momentOfFrame() const { return momentAt(pacer_.deviceTime()); }
  [[nodiscard]] Moment momentAt(DeviceTime start) const {
    Moment moment;
    moment.exposures = model_.exposures(start);
    moment.clock = pacer_.clock();
    moment.since_power_on = since_power_on_ + static_cast<double>(start.ns) * nanosecond;
    moment.temperatures = model_.temperatures(room_temperature_, *moment.since_power_on);
    moment.temperatures.push_back({"room", room_temperature_});
    moment.ambient = ambient_;
    moment.world_from_camera = view_.poseAt(sim::middleOf(moment));
    return moment;
  }

  Keys keys_;
  sim::SensorModel base_;   ///< as its file says, but for numbers that were set
  sim::SensorModel model_;  ///< that one as it is operated
  Operating operating_;
  ImageFilters filters_;
  const std::vector<PlaneKind> planes_;  ///< of the configuration
  SourceInfo info_;
  View view_;
  std::optional<ColorView> color_;  ///< if its plane is wanted
  std::optional<sim::Samples> collected_;  ///< of the present pose and parameters, free of noise
  sim::Truth truth_of_middle_;  ///< where things move: at the middle raw exposure
  std::optional<Plane> sigma_of_middle_;  ///< the same, if it is wanted
  /// Of the frame before, where an effect remembers it.
  std::optional<sim::Samples> last_collected_;
  std::optional<sim::RangeImage> last_range_;
  Pacer pacer_;  ///< its frame index keys the noise
  std::uint64_t made_ = 0;  ///< since start()
  int frames_as_they_are_ = 0;  ///< since pose, exposures or anything else of the model were set
  Duration since_power_on_;  ///< at device time 0
  Temperature room_temperature_;
  Illuminance ambient_;
};

Result<std::unique_ptr<Source>> open(settings::Table& table) {
  auto chosen = choose(table);
  if (!chosen) return chosen.error();
  sim::TraceRequest request = chosen->model.traceRequest();
  chosen->keys.applyTo(request);
  if (const auto missing = sim::missingLight(chosen->scene, request.emitters, chosen->keys.mode == Mode::RealTime))
    logging::warn("{}: {}", table.place("scene"), *missing);
  for (const std::string& note : chosen->model.notes()) logging::warn("{}", note);
  if (const auto off_axis = sim::lensOffAxis(chosen->model.camera()))
    logging::warn("{}: {}", table.place(table.has("camera") ? "camera" : "uri"), *off_axis);
  for (const std::string& note : chosen->scene.notes()) logging::warn("{}: {}", table.place("scene"), note);
  if (const auto nothing = sim::seesNothing(chosen->scene, chosen->model.camera(), startPose(chosen->keys)))
    logging::warn("{}: {}", table.place(table.has("scene") ? "scene" : ""), *nothing);
  auto interferences = chosen->model.interferences(chosen->scene.foreignEmitters());
  View view{std::move(chosen->scene), std::move(request), std::move(interferences), motionOf(chosen->keys),
            chosen->model.rowDelay()};
  if (chosen->keys.mode == Mode::RealTime) view.goRealtime(chosen->model);
  return std::unique_ptr<Source>{std::make_unique<SimulatedSource>(std::move(*chosen), std::move(view))};
}

std::vector<std::string> list() {
  std::vector<std::string> uris;
  for (const std::string& name : sim::SensorModel::presetNames()) uris.push_back("sim:" + name);
  return uris;
}

}  // namespace

Driver row() {
  return {.name = "sim",
          .summary = "a simulated camera in a scene: path-traced light through a sensor model",
          .list = list,
          .open = open,
          .document = [] { return settings::markdownTable(settings::keysOf<Keys>()); }};
}

}  // namespace toftwin::drivers::simulator
