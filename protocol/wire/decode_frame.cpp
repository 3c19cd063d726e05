// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/header_checks.h"

namespace toftwin::wire {
namespace {

Moment readMoment(Checks& checks, const fb::Moment* table) {
  Moment moment;
  if (!table) return moment;
  for (const auto* exposure : checks.items(table->exposures(), kMaxExposures, "moment.exposures")) {
    moment.exposures.push_back(
        {.start = {exposure->start_device_ns()},
         .duration = checks.finiteFromZero(exposure->duration_s(), "exposure.duration_s") * second,
         .modulation =
             checks.finiteFromZero(exposure->modulation_hz(), "exposure.modulation_hz") * hertz});
  }
  moment.received = {table->received_host_ns()};
  moment.clock = {table->host_minus_device_ns(), table->clock_uncertainty_ns()};
  checks.require(moment.clock.uncertainty_ns >= -1, "moment.clock_uncertainty_ns", "is below -1");
  if (const auto time_s = table->since_power_on_s()) {
    moment.since_power_on = checks.finite(*time_s, "moment.since_power_on_s") * second;
  }
  for (const auto* temperature :
       checks.items(table->temperatures(), kMaxTemperatures, "moment.temperatures")) {
    moment.temperatures.push_back(
        {checks.name(temperature->where(), "temperature.where"),
         checks.finite(temperature->value_c(), "temperature.value_c") * celsius});
  }
  if (const auto ambient_klx = table->ambient_klx()) {
    moment.ambient = checks.finite(*ambient_klx, "moment.ambient_klx") * kilolux;
  }
  if (const fb::Pose* pose = table->world_from_camera()) {
    moment.world_from_camera = readPose(checks, *pose);
  }
  return moment;
}

Provenance readProvenance(Checks& checks, const fb::Provenance* table) {
  if (!table) return {};
  return {.kind = checks.oneOf(table->kind(), FrameKind::Faulted, "provenance.kind"),
          .calibration_id = checks.name(table->calibration_id(), "provenance.calibration_id"),
          .scene_id = checks.name(table->scene_id(), "provenance.scene_id"),
          .model_id = checks.name(table->model_id(), "provenance.model_id"),
          .seed = table->seed(),
          .effects = checks.names(table->effects(), "provenance.effects")};
}

/// A plane that lies in the body behind `end`, where the last one ended; moves `end` on.
Plane readPlane(Checks& checks, const fb::Plane& table, std::uint64_t body_bytes, std::uint64_t& end) {
  Plane plane;
  plane.kind = checks.oneOf(table.kind(), kLastPlaneKind, "plane.kind");
  plane.type = checks.oneOf(table.type(), ElementType::F32, "plane.type");
  checks.require(table.width() >= 1 && table.width() <= kMaxSide, "plane.width",
                 "is not 1 to 65535");
  checks.require(table.height() >= 1 && table.height() <= kMaxSide, "plane.height",
                 "is not 1 to 65535");
  checks.require(table.channels() >= 1 && table.channels() <= kMaxChannels, "plane.channels",
                 "is not 1 to 1024");
  if (checks.failed()) return plane;
  // At most 4 · 2^16 · 2^16 · 2^10 = 2^44: no overflow.
  const std::uint64_t bytes =
      std::uint64_t{sizeOf(plane.type)} * table.width() * table.height() * table.channels();
  const std::uint64_t offset = table.offset();
  checks.require(table.bytes() == bytes, "plane.bytes", "is not type × width × height × channels");
  checks.require(offset % kAlignment == 0, "plane.offset", "is not a multiple of 64");
  checks.require(offset >= end, "plane.offset", "lies before the end of the plane before it");
  checks.require(bytes <= body_bytes && offset <= body_bytes - bytes, "plane.offset",
                 "puts the plane beyond the body's end");
  if (checks.failed()) return plane;
  end = offset + bytes;
  plane.width = static_cast<int>(table.width());
  plane.height = static_cast<int>(table.height());
  plane.channels = static_cast<int>(table.channels());
  return plane;
}

}  // namespace

CameraInfo readCamera(Checks& checks, const fb::Camera* table) {
  CameraInfo camera;
  if (!table) return camera;
  checks.require(table->width() <= kMaxSide, "camera.width", "is more than 65535");
  checks.require(table->height() <= kMaxSide, "camera.height", "is more than 65535");
  if (checks.failed()) return camera;
  camera.width = static_cast<int>(table->width());
  camera.height = static_cast<int>(table->height());
  if (const fb::Intrinsics* in = table->intrinsics()) {
    camera.fx = checks.finite(in->fx_px(), "camera.fx_px");
    camera.fy = checks.finite(in->fy_px(), "camera.fy_px");
    camera.cx = checks.finite(in->cx_px(), "camera.cx_px");
    camera.cy = checks.finite(in->cy_px(), "camera.cy_px");
    camera.distortion = {checks.finite(in->k1(), "camera.k1"), checks.finite(in->k2(), "camera.k2"),
                         checks.finite(in->p1(), "camera.p1"), checks.finite(in->p2(), "camera.p2"),
                         checks.finite(in->k3(), "camera.k3")};
  }
  camera.calibration_id = checks.name(table->calibration_id(), "camera.calibration_id");
  return camera;
}

Transform<World, Camera> readPose(Checks& checks, const fb::Pose& pose) {
  Transform<World, Camera> world_from_camera;
  world_from_camera.rotation_wxyz = {checks.finite(pose.rotation_w(), "pose.rotation_w"),
                                     checks.finite(pose.rotation_x(), "pose.rotation_x"),
                                     checks.finite(pose.rotation_y(), "pose.rotation_y"),
                                     checks.finite(pose.rotation_z(), "pose.rotation_z")};
  world_from_camera.translation_m = {checks.finite(pose.x_m(), "pose.x_m"),
                                     checks.finite(pose.y_m(), "pose.y_m"),
                                     checks.finite(pose.z_m(), "pose.z_m")};
  return world_from_camera;
}

FrameMessage readFrame(Checks& checks, const fb::Frame& table, std::uint64_t body_bytes) {
  FrameMessage message;
  message.subscription = table.subscription();
  Frame& frame = message.frame;
  frame.source = checks.name(table.source(), "frame.source");
  frame.sequence = table.sequence();
  frame.dropped_before = table.dropped_before();
  frame.dropped_by_device = table.dropped_by_device();
  frame.dropped_because = checks.text(table.dropped_because(), kMaxText, "frame.dropped_because");
  frame.moment = readMoment(checks, table.moment());
  frame.provenance = readProvenance(checks, table.provenance());
  frame.camera = readCamera(checks, table.camera());
  std::uint64_t end = 0;
  for (const auto* plane : checks.items(table.planes(), kMaxPlanes, "frame.planes")) {
    frame.planes.push_back(readPlane(checks, *plane, body_bytes, end));
  }
  checks.require(body_bytes == paddedToAlignment(end), "body", "goes on behind the last plane");
  return message;
}

void attachPlanes(FrameMessage& message, const fb::Frame& table, const Buffer& body) {
  std::vector<Plane>& planes = message.frame.planes;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const fb::Plane& entry = *table.planes()->Get(static_cast<flatbuffers::uoffset_t>(i));
    planes[i].data = body.part(entry.offset(), entry.bytes());
  }
}

}  // namespace toftwin::wire
