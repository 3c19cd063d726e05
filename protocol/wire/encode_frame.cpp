// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/header_writer.h"

namespace toftwin::wire {
namespace {

Offset<fb::Moment> writeMoment(Builder& builder, const Moment& moment) {
  std::vector<Offset<fb::Exposure>> exposures;
  for (std::size_t i = 0; i < countOf(moment.exposures, kMaxExposures); ++i) {
    const Exposure& exposure = moment.exposures[i];
    exposures.push_back(fb::CreateExposure(builder, exposure.start.ns, exposure.duration.in(second),
                                           exposure.modulation.in(hertz)));
  }
  std::vector<Offset<fb::Temperature>> temperatures;
  for (std::size_t i = 0; i < countOf(moment.temperatures, kMaxTemperatures); ++i) {
    const NamedTemperature& temperature = moment.temperatures[i];
    const auto where = writeName(builder, temperature.where);
    temperatures.push_back(fb::CreateTemperature(builder, where, temperature.value.in(celsius)));
  }
  const auto exposure_list = builder.CreateVector(exposures);
  const auto temperature_list = builder.CreateVector(temperatures);

  fb::MomentBuilder table{builder};
  table.add_exposures(exposure_list);
  table.add_received_host_ns(moment.received.ns);
  table.add_host_minus_device_ns(moment.clock.host_minus_device_ns);
  table.add_clock_uncertainty_ns(moment.clock.uncertainty_ns);
  if (moment.since_power_on) table.add_since_power_on_s(moment.since_power_on->in(second));
  table.add_temperatures(temperature_list);
  if (moment.ambient) table.add_ambient_klx(moment.ambient->in(kilolux));
  fb::Pose pose;
  if (moment.world_from_camera) {
    pose = toPose(*moment.world_from_camera);
    table.add_world_from_camera(&pose);
  }
  return table.Finish();
}

Offset<fb::Provenance> writeProvenance(Builder& builder, const Provenance& provenance) {
  const auto calibration_id = writeName(builder, provenance.calibration_id);
  const auto scene_id = writeName(builder, provenance.scene_id);
  const auto model_id = writeName(builder, provenance.model_id);
  const auto effects = writeNames(builder, provenance.effects);
  return fb::CreateProvenance(builder, static_cast<std::uint8_t>(provenance.kind), calibration_id,
                              scene_id, model_id, provenance.seed, effects);
}

/// The planes where `encodeBody` puts them: one after the other, each padded to 64 bytes.
Offset<flatbuffers::Vector<Offset<fb::Plane>>> writePlanes(Builder& builder,
                                                           const std::vector<Plane>& planes) {
  std::vector<Offset<fb::Plane>> tables;
  std::uint64_t offset = 0;
  for (std::size_t i = 0; i < countOf(planes, kMaxPlanes); ++i) {
    const Plane& plane = planes[i];
    tables.push_back(fb::CreatePlane(
        builder, static_cast<std::uint8_t>(plane.kind), static_cast<std::uint8_t>(plane.type),
        static_cast<std::uint32_t>(plane.width), static_cast<std::uint32_t>(plane.height),
        static_cast<std::uint32_t>(plane.channels), offset, plane.data.size()));
    offset += paddedToAlignment(plane.data.size());
  }
  return builder.CreateVector(tables);
}

}  // namespace

Offset<flatbuffers::String> writeName(Builder& builder, std::string_view name) {
  if (name.empty()) return {};
  return builder.CreateString(name.data(), countOf(name, kMaxName));
}

Offset<flatbuffers::String> writeText(Builder& builder, std::string_view text) {
  if (text.empty()) return {};
  if (text.size() > kMaxText) {
    std::size_t end = kMaxText;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0u) == 0x80u) --end;
    text = text.substr(0, end);
  }
  return builder.CreateString(text.data(), text.size());
}

Offset<Texts> writeNames(Builder& builder, const std::vector<std::string>& names) {
  if (names.empty()) return {};
  std::vector<Offset<flatbuffers::String>> texts;
  for (std::size_t i = 0; i < countOf(names, kMaxNames); ++i) {
    const auto text = writeName(builder, names[i]);
    texts.push_back(text.IsNull() ? builder.CreateString("") : text);  // a list has no absent items
  }
  return builder.CreateVector(texts);
}

Offset<fb::Camera> writeCamera(Builder& builder, const CameraInfo& camera) {
  const auto calibration_id = writeName(builder, camera.calibration_id);
  const auto& [k1, k2, p1, p2, k3] = camera.distortion;
  const fb::Intrinsics intrinsics{camera.fx, camera.fy, camera.cx, camera.cy, k1, k2, p1, p2, k3};
  return fb::CreateCamera(builder, static_cast<std::uint32_t>(camera.width),
                          static_cast<std::uint32_t>(camera.height), &intrinsics, calibration_id);
}

fb::Pose toPose(const Transform<World, Camera>& world_from_camera) {
  const auto& [w, x, y, z] = world_from_camera.rotation_wxyz;
  const Vec3d& t = world_from_camera.translation_m;
  return {w, x, y, z, t.x, t.y, t.z};
}

Offset<fb::Frame> writeFrame(Builder& builder, const FrameMessage& message) {
  const Frame& frame = message.frame;
  const auto source = writeName(builder, frame.source);
  const auto moment = writeMoment(builder, frame.moment);
  const auto provenance = writeProvenance(builder, frame.provenance);
  const auto camera = writeCamera(builder, frame.camera);
  const auto planes = writePlanes(builder, frame.planes);
  const auto dropped_because = writeText(builder, frame.dropped_because);
  return fb::CreateFrame(builder, message.subscription, source, frame.sequence,
                         frame.dropped_before, frame.dropped_by_device, moment, provenance, camera,
                         planes, dropped_because);
}

}  // namespace toftwin::wire
