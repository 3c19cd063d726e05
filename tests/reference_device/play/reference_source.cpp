// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/play/reference_source.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <utility>

#include <toftwin/image.h>

#include "drivers/loss_reasons.h"
#include "drivers/pace.h"
#include "protocol/settings/describe.h"
#include "tests/reference_device/device/device.h"

namespace toftwin::reference {
namespace {

using drivers::Pace;
using drivers::SourceInfo;
using drivers::SourceState;

struct Keys {
  std::string uri = "reference:0";
  std::string camera, scene, sealed;
  double scale = 1.0;
  std::uint64_t seed = 1;
  Pace pace = Pace::RealTime;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("uri", uri, "reference: and the serial number");
    v.text("camera", camera, "path of the camera file that the maker gives out, relative to this file");
    v.text("scene", scene, "path of the scene file, relative to this file: rectangles and boxes");
    v.text("sealed", sealed,
           "path of the sealed specification, relative to this file; empty: nothing is hidden");
    v.number("scale", scale, {0.0, 1e9}, "of all hidden strengths");
    v.number("seed", seed, {0, 9'007'199'254'740'992.0}, "of noise and of the rig's errors");
    v.choice("pace", pace, {{"real_time", Pace::RealTime}, {"fast", Pace::Fast}, {"trigger", Pace::Trigger}},
             "when a frame comes; under lockstep the clients say when");
  }
};

constexpr std::string_view kExposure = "exposure_us", kAmbient = "ambient_klx",
                           kSincePowerOn = "since_power_on_s", kRoom = "room_temperature_c";
constexpr Bounds kAmbientBounds{0.0, 200.0}, kSinceBounds{0.0, 1e9}, kRoomBounds{-40.0, 100.0};

SourceInfo describe(const Keys& keys, const Datasheet& sheet) {
  SourceInfo info;
  info.driver = "reference";
  info.model = sheet.model;
  info.serial = fmt::format("{}/{}", keys.uri, keys.seed);
  info.kind = FrameKind::Real;
  info.camera = sheet.camera();
  info.planes = {PlaneKind::Range, PlaneKind::Depth,   PlaneKind::Amplitude, PlaneKind::Ambient,
                 PlaneKind::Flags, PlaneKind::Samples, PlaneKind::Phasors};
  info.frame_interval = sheet.sampling.frame_interval;
  info.can_set_pose = true;
  info.can_trigger = keys.pace == Pace::Trigger;
  info.can_lockstep = true;
  info.parameters = {std::string{kExposure}, std::string{kAmbient}, std::string{kSincePowerOn},
                     std::string{kRoom}};
  return info;
}

Plane planeOf(PlaneKind kind, const Datasheet& sheet, int channels, std::vector<float> values) {
  return {kind,
          ElementType::F32,
          sheet.lens.width,
          sheet.lens.height,
          channels,
          Buffer::adopt(std::move(values))};
}

class ReferenceSource final : public drivers::Source {
 public:
  ReferenceSource(const Keys& keys, Device device)
      : keys_(keys),
        device_(std::move(device)),
        info_(describe(keys, device_.sheet())),
        pacer_(keys.pace, *info_.frame_interval) {
    for (int y = 0; y < info_.camera.height; ++y) {
      for (int x = 0; x < info_.camera.width; ++x) ray_z_.push_back(rayThroughPixel(info_.camera, x, y).v.z);
    }
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  Result<> start() override {
    pacer_.restart();
    return {};
  }
  void stop() override {}

  Result<Frame> next(std::stop_token stop, bool lockstep) override {
    const auto lost = pacer_.waitForTurn(stop, lockstep);
    if (!lost) return lost.error();
    const State state = stateNow();
    Frame frame;
    drivers::addLost(frame, *lost, drivers::kNotInTime);
    frame.moment = momentOf(state);
    frame.provenance.kind = FrameKind::Real;
    frame.camera = info_.camera;
    frame.planes = planesOf(device_.expose(state, pacer_.index()));
    pacer_.advance();
    return frame;
  }

  [[nodiscard]] SourceState state() const override {
    return {{{std::string{kExposure}, exposure_us_, exposureBounds()},
             {std::string{kAmbient}, state_.ambient_klx, kAmbientBounds},
             {std::string{kSincePowerOn}, {}, kSinceBounds},
             {std::string{kRoom}, state_.room_c, kRoomBounds}},
            state_.world_from_camera};
  }

  Result<> setPose(const Transform<World, Camera>& world_from_camera) override {
    const auto& q = world_from_camera.rotation_wxyz;
    const Vec3d& t = world_from_camera.translation_m;
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(std::abs(length - 1.0) < 1e-6) || !std::isfinite(t.x + t.y + t.z)) {
      return Error{Error::Code::InvalidArgument, "a pose needs a unit quaternion and finite metres"};
    }
    state_.world_from_camera = world_from_camera;
    return {};
  }

  Result<> setParameter(std::string_view name, double value) override {
    const auto set = [&](double& into, Bounds bounds, double to) -> Result<> {
      if (std::isnan(value) || !bounds.contains(value)) {
        return Error{Error::Code::InvalidArgument, fmt::format("{} = {} is out of bounds: it must be {}",
                                                               name, value, settings::describe(bounds))};
      }
      into = to;
      return {};
    };
    if (name == kExposure) return set(exposure_us_, exposureBounds(), value);
    if (name == kAmbient) return set(state_.ambient_klx, kAmbientBounds, value);
    if (name == kRoom) return set(state_.room_c, kRoomBounds, value);
    if (name == kSincePowerOn) {
      capture_s_ = value;
      return set(power_on_s_, kSinceBounds, value - deviceTime_s());
    }
    return Error{Error::Code::NotFound, fmt::format("this camera has no parameter \"{}\"; it has: {}", name,
                                                    fmt::join(info_.parameters, ", "))};
  }

  Result<> trigger() override {
    if (!info_.can_trigger) return Source::trigger();
    pacer_.trigger();
    return {};
  }

 private:
  [[nodiscard]] double declaredExposure_us() const {
    return device_.sheet().modulations.front().exposure.in(microsecond);
  }
  /// Raw exposures and gaps must fit between two frames.
  [[nodiscard]] Bounds exposureBounds() const {
    const auto& sampling = device_.sheet().sampling;
    const auto count = static_cast<double>(device_.sheet().modulations.size()) * sampling.steps;
    return {1.0, std::min(20'000.0,
                          sampling.frame_interval.in(microsecond) / count - sampling.gap.in(microsecond))};
  }
  [[nodiscard]] double deviceTime_s() const { return static_cast<double>(pacer_.deviceTime().ns) * 1e-9; }

  /// The rig errs anew for each pose and each time that a clock was set to.
  [[nodiscard]] State stateNow() const {
    State state = state_;
    state.exposure_scale = exposure_us_ / declaredExposure_us();
    state.since_power_on_s = power_on_s_ + deviceTime_s();
    const auto& pose = state.world_from_camera;
    for (const double number :
         {pose.translation_m.x, pose.translation_m.y, pose.translation_m.z, pose.rotation_wxyz[0],
          pose.rotation_wxyz[1], pose.rotation_wxyz[2], pose.rotation_wxyz[3], capture_s_})
      state.capture = Dice::key(state.capture, std::bit_cast<std::uint64_t>(number));
    return state;
  }

  [[nodiscard]] Moment momentOf(const State& state) const {
    const Datasheet& sheet = device_.sheet();
    Moment moment;
    DeviceTime start = pacer_.deviceTime();
    for (const auto& modulation : sheet.modulations) {
      for (int k = 0; k < sheet.sampling.steps; ++k) {
        const Duration exposure = state.exposure_scale * modulation.exposure;
        moment.exposures.push_back({start, exposure, modulation.frequency});
        start.ns += std::llround((exposure + sheet.sampling.gap).in(nanosecond));
      }
    }
    moment.clock = pacer_.clock();
    moment.since_power_on = state.since_power_on_s * second;
    const Circumstances now = device_.circumstances(state, pacer_.index());
    moment.temperatures = {{"illumination", now.illumination_c * celsius},
                           {"sensor", now.sensor_c * celsius},
                           {"room", device_.roomNow_c(state) * celsius}};
    moment.ambient = state.ambient_klx * kilolux;
    moment.world_from_camera = state.world_from_camera;
    return moment;
  }

  /// In the order announced.
  [[nodiscard]] std::vector<Plane> planesOf(const Device::Exposed& exposed) const {
    const Datasheet& sheet = device_.sheet();
    const Measured& measured = exposed.measured;
    const std::size_t pixels = measured.range_m.size(),
                      channels = exposed.charges.frequencies * exposed.charges.steps;
    std::vector<float> depth_m(pixels), samples(channels * pixels), phasors(2 * measured.phasors.size());
    for (std::size_t i = 0; i < pixels; ++i) {
      depth_m[i] = static_cast<float>(static_cast<double>(measured.range_m[i]) * ray_z_[i]);
      for (std::size_t c = 0; c < channels; ++c) {
        samples[c * pixels + i] = static_cast<float>(
            exposed.charges.difference(c / exposed.charges.steps, c % exposed.charges.steps, i));
      }
      for (std::size_t f = 0; f < exposed.charges.frequencies; ++f) {
        phasors[2 * f * pixels + i] = measured.phasors[f * pixels + i].real();
        phasors[(2 * f + 1) * pixels + i] = measured.phasors[f * pixels + i].imag();
      }
    }
    Image<std::uint8_t> flags{measured.width, measured.height};
    std::ranges::copy(measured.flags, flags.pixels().begin());
    return {planeOf(PlaneKind::Range, sheet, 1, measured.range_m),
            planeOf(PlaneKind::Depth, sheet, 1, std::move(depth_m)),
            planeOf(PlaneKind::Amplitude, sheet, 1, measured.amplitude),
            planeOf(PlaneKind::Ambient, sheet, 1, measured.ambient),
            toPlane(PlaneKind::Flags, std::move(flags)),
            planeOf(PlaneKind::Samples, sheet, static_cast<int>(channels), std::move(samples)),
            planeOf(PlaneKind::Phasors, sheet, static_cast<int>(2 * exposed.charges.frequencies),
                    std::move(phasors))};
  }

  Keys keys_;
  Device device_;
  SourceInfo info_;
  drivers::Pacer pacer_;
  std::vector<double> ray_z_;
  State state_;
  double exposure_us_ = declaredExposure_us();
  double power_on_s_ = State{}.since_power_on_s;  ///< at device time 0
  double capture_s_ = 0.0;                        ///< what the clock was set to last
};

Result<std::unique_ptr<drivers::Source>> open(settings::Table& table) {
  Keys keys;
  table.read(keys);
  for (const auto& [name, path] : {std::pair{"camera", &keys.camera}, std::pair{"scene", &keys.scene}}) {
    if (path->empty()) table.complain(name, "is missing: name a file");
  }
  if (auto checked = table.check(); !checked) return checked.error();
  if (!keys.uri.starts_with("reference:")) {
    return Error{Error::Code::NotFound,
                 fmt::format("{}: there is no camera {}; say reference: and a serial number",
                             table.place("uri"), keys.uri)};
  }
  auto sheet = readDatasheet(table.resolve(keys.camera));
  if (!sheet) return sheet.error();
  auto room = readRoom(table.resolve(keys.scene));
  if (!room) return room.error();
  auto sealed =
      readSealed(keys.sealed.empty() ? std::filesystem::path{} : table.resolve(keys.sealed), keys.scale);
  if (!sealed) return sealed.error();
  Device device{*std::move(room), *std::move(sheet), *std::move(sealed), keys.seed, {}};
  return std::unique_ptr<drivers::Source>{std::make_unique<ReferenceSource>(keys, std::move(device))};
}

}  // namespace

drivers::Driver sourceRow() {
  return {.name = "reference",
          .summary = "the reference device: a camera that is not the simulator",
          .list = [] { return std::vector<std::string>{}; },
          .open = open,
          .document = [] { return settings::markdownTable(settings::keysOf<Keys>()); }};
}

}  // namespace toftwin::reference
