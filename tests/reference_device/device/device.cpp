// SPDX-License-Identifier: Apache-2.0
#include "tests/reference_device/device/device.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace toftwin::reference {
namespace {

constexpr double kAirConditioning_c = 1.5, kAirConditioning_s = 1200.0;

double swing(double since_power_on_s) {
  return std::sin(2.0 * std::numbers::pi * since_power_on_s / kAirConditioning_s);
}

double leastTransfer_m(const Sealed& sealed) {
  double least_m = 0.0;
  for (const auto& one : sealed.hidden) least_m = std::max(least_m, one->leastTransfer_m());
  return least_m;
}

RadiosityOptions withLeastTransfer(RadiosityOptions options, const Sealed& sealed) {
  options.least_transfer_m = leastTransfer_m(sealed);
  return options;
}

void scale(Light& light, double factor) {
  for (auto& p : light.phasors) p *= factor;
  for (double& s : light.steady) s *= factor;
}

Vec3d normals(Dice& dice, double sigma) {
  return {sigma * dice.normal(), sigma * dice.normal(), sigma * dice.normal()};
}

}  // namespace

Device::Device(Room room, Datasheet sheet, Sealed sealed, std::uint64_t seed, RadiosityOptions options)
    : transport_(room, sheet, withLeastTransfer(options, sealed)), sealed_(std::move(sealed)), seed_(seed) {
  if (leastTransfer_m(sealed_) > 0.0) plain_.emplace(std::move(room), sheet, options);
}

double Device::roomNow_c(const State& state) const {
  return state.room_c + kAirConditioning_c * swing(state.since_power_on_s);
}

Circumstances Device::circumstances(const State& state, std::uint64_t frame) const {
  const auto& thermal = sheet().thermal;
  const double t = state.since_power_on_s, room = roomNow_c(state);
  const double sensor_s = thermal.sensor_time.in(second), omega = 2.0 * std::numbers::pi / kAirConditioning_s;
  Circumstances now{.since_power_on_s = t,
                    .exposure_s = sheet().modulations.front().exposure.in(second)*state.exposure_scale,
                    .ambient_klx = state.ambient_klx,
                    .frame = frame,
                    .world_from_camera = state.world_from_camera};
  now.illumination_c =
      room + thermal.illumination_rise_c * (1.0 - std::exp(-t / thermal.illumination_time.in(second)));
  now.sensor_c = room + thermal.sensor_rise_c * (1.0 - std::exp(-t / sensor_s));
  now.sensor_rate_c_per_s = thermal.sensor_rise_c / sensor_s * std::exp(-t / sensor_s) +
                            kAirConditioning_c * omega * std::cos(omega * t);
  return now;
}

const Light& Device::lightAt(const Transform<World, Camera>& world_from_camera, bool with_hidden) {
  const bool is_plain = plain_ && !with_hidden;
  if (!kept_ || kept_->is_plain != is_plain || kept_->pose != world_from_camera)
    kept_ = {world_from_camera, is_plain, (is_plain ? *plain_ : transport_).see(world_from_camera)};
  return kept_->light;
}

Transform<World, Camera> Device::standing(Transform<World, Camera> commanded) const {
  Vec3d misplaced{};
  for (const auto& one : sealed_.hidden) misplaced = misplaced + one->misplaced_m(commanded);
  commanded.translation_m = commanded.translation_m + misplaced;
  return commanded;
}

Device::Exposed Device::make(Light light, const State& state, std::uint64_t frame, bool with_hidden,
                             Dice* dice) const {
  const Circumstances now = circumstances(state, frame);
  if (with_hidden) {
    for (const auto& one : sealed_.hidden) one->onLight(light, transport_, now);
  }
  const auto* ambient = sheet().declares("ambient_light");
  const double ambient_w_per_m2 =
      ambient == nullptr ? 0.0 : ambient->irradiance_w_per_m2_per_klx * state.ambient_klx;
  Exposed exposed{collect(light, sheet(), state.exposure_scale, ambient_w_per_m2), {}};
  if (with_hidden) {
    for (const auto& one : sealed_.hidden) one->onSamples(exposed.charges, light, now);
  }
  readOut(exposed.charges, sheet(), dice);
  exposed.measured = decode(exposed.charges, sheet());
  if (with_hidden) {
    for (const auto& one : sealed_.hidden) one->onRange(exposed.measured, light, now);
  }
  return exposed;
}

Device::Exposed Device::expose(const State& state, std::uint64_t frame) {
  Dice rig{Dice::key(Dice::key(seed_, 1), state.capture)};
  const Vec3d shift = normals(rig, sealed_.rig.position_mm * 1e-3);
  const Vec3d turn = normals(rig, sealed_.rig.rotation_deg * std::numbers::pi / 180.0);
  const double gain = 1.0 + sealed_.rig.gain * rig.normal(), angle = norm(turn);
  Transform<Camera, Camera> error;
  if (angle > 0.0) error = rotation<Camera, Camera>(turn / angle, angle);
  error.translation_m = shift;
  Light light = lightAt(standing(state.world_from_camera) * error, true);
  scale(light, gain);
  Dice dice{Dice::key(Dice::key(seed_, 2), frame)};
  return make(std::move(light), state, frame, true, &dice);
}

Device::Exposed Device::exposeNoiseFree(const State& state, std::uint64_t frame, bool with_hidden,
                                        const Transform<Camera, Camera>& nudge) {
  const auto pose = with_hidden ? standing(state.world_from_camera) : state.world_from_camera;
  return make(lightAt(pose * nudge, with_hidden), state, frame, with_hidden, nullptr);
}

}  // namespace toftwin::reference
