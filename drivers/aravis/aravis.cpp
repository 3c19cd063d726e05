// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/aravis.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "drivers/aravis/configuration.h"
#include "drivers/aravis/connection.h"
#include "drivers/aravis/region.h"
#include "drivers/aravis/source.h"
#include "drivers/aravis/stream.h"
#include "drivers/logging.h"
#include "drivers/ray_fit.h"
#include "protocol/settings/describe.h"

namespace toftwin::drivers::aravis {
namespace {

constexpr std::string_view kScheme = "aravis:";
constexpr double kWorstFit_px = 1.0;
constexpr std::chrono::milliseconds kFirstFrameWait{2000};

Result<> checkKeys(const Keys& keys, settings::Table& table) {
  if (!keys.uri.starts_with(kScheme)) {
    table.complain("uri", fmt::format("= \"{}\" must begin with aravis:, such as "
                                      "aravis:192.168.0.20 or aravis:any",
                                      keys.uri));
  }
  if (!keys.pixel_format.empty() && pixelFormatNamed(keys.pixel_format) == nullptr) {
    table.complain("pixel_format",
                   fmt::format("= \"{}\" cannot be read here; it must be one of: {}, {}", keys.pixel_format,
                               pixelFormatNames(Role::Range), pixelFormatNames(Role::Intensity)));
  }
  for (const std::string& one : keys.set) {
    if (!assignmentOf(one))
      table.complain("set", fmt::format("has \"{}\"; write \"ExposureTime = 1000\"", one));
  }
  if (keys.lens.fx > 0.0 && keys.lens.field_of_view > 0_deg) {
    table.complain("lens", "has fx and field_of_view_deg, which say the same twice; leave one out");
  }
  return table.check();
}

/// Points in space say where the pixels look: one frame of them is enough. Nothing if none comes,
/// or if they are no camera's.
std::optional<CameraInfo> lensFromPoints(Connection& connection, const Keys& keys,
                                         const Setup& setup) {
  Stream stream{keys};
  if (!stream.start(connection)) return std::nullopt;
  Failure ignored;
  if (setup.can_trigger) arv_camera_software_trigger(connection.camera(), ignored.slot());
  std::optional<CameraInfo> camera;
  const auto until = std::chrono::steady_clock::now() + kFirstFrameWait;
  while (!camera && std::chrono::steady_clock::now() < until) {
    auto filled = stream.take(std::chrono::milliseconds{100});
    if (!filled) continue;
    const Part* part = partFor(Role::Range, filled->parts);
    if (part != nullptr && part->width == setup.width && part->height == setup.height) {
      const auto rays = raysOf(*part, setup.scan);
      auto fit =
          rays ? fitCamera(setup.width, setup.height, *rays) : Result<FittedCamera>{rays.error()};
      if (!fit) logging::warn("aravis: its points say no lens: {}", fit.error().message);
      if (fit && fit->rms_px > kWorstFit_px) {
        logging::warn(
            "aravis: a lens explains its points to {:.1f} pixels only, so it is not taken",
            fit->rms_px);
      } else if (fit) {
        camera = fit->camera;
      }
      if (!camera) break;
    }
    stream.giveBack(*std::move(filled));
  }
  stream.stop(connection);
  return camera;
}

/// What was calibrated, or a person wrote, or the camera says, or its points say.
Result<Lens> findLens(Connection& connection, const Keys& keys, const Setup& setup,
                      const std::optional<CameraInfo>& calibrated) {
  if (calibrated) return lensOfRegion(*calibrated, setup.region);
  auto lens = lensOfRegion(keys.lens, setup.region);
  if (!lens || lens->is_known) return lens;
  if (setup.lens) return lensFor(*setup.lens, setup.width, setup.height, About::name);
  if (setup.layout.has_points && (!setup.is_triggered || setup.can_trigger)) {
    if (const auto fitted = lensFromPoints(connection, keys, setup)) {
      const LensKeys said{.fx = fitted->fx,
                          .fy = fitted->fy,
                          .cx = fitted->cx,
                          .cy = fitted->cy,
                          .distortion = fitted->distortion};
      return lensFor(said, setup.width, setup.height, About::name);
    }
  }
  if (setup.layout.has_range) {
    logging::warn("aravis: {}: nothing is known of this camera's lens{}; give [source.lens]",
                  keys.uri,
                  setup.layout.has_points ? ""
                  : setup.scan.c_is_range ? ", so it has no depth image"
                                          : ", so it has no range image");
  }
  return lens;
}

std::string textOr(const char* text, const char* otherwise) {
  return text == nullptr || *text == 0 ? otherwise : text;
}

SourceInfo infoOf(const Connection& connection, const Setup& setup, const ImageMaker& images) {
  Failure ignored;
  ArvCamera* camera = connection.camera();
  SourceInfo info;
  info.driver = About::name;
  info.model =
      fmt::format("{} {}", textOr(arv_camera_get_vendor_name(camera, ignored.slot()), "GenICam"),
                  textOr(arv_camera_get_model_name(camera, ignored.slot()), "camera"));
  info.serial = textOr(arv_camera_get_device_serial_number(camera, ignored.slot()), "unknown");
  info.kind = FrameKind::Real;
  info.camera = images.camera();
  info.planes = images.kinds();
  info.frame_interval = setup.frame_interval;
  info.can_trigger = setup.can_trigger;
  info.parameters = setup.parameters;
  return info;
}

Result<std::unique_ptr<Source>> open(settings::Table& table) {
  Keys keys;
  table.read(keys);
  const auto calibrated = calibrationAt(table, keys.calibration);
  if (auto checked = checkKeys(keys, table); !checked) return checked.error();
  auto connection = Connection::open(keys.uri.substr(kScheme.size()));
  if (!connection) return answerAtOpening(connection.error());
  const auto setup = configure(*connection, keys);
  if (!setup) {
    if (setup.error().code == Error::Code::Disconnected) connection->giveUp();
    return answerAtOpening(setup.error());
  }
  const auto lens = findLens(*connection, keys, *setup, calibrated);
  if (!lens) return lens.error();
  ImageMaker images{setup->layout, setup->scan, *lens};
  SourceInfo info = infoOf(*connection, *setup, images);
  return makeSource({.keys = std::move(keys),
                     .info = std::move(info),
                     .connection = *std::move(connection),
                     .images = std::move(images)});
}

std::vector<std::string> list() {
  std::vector<std::string> uris;
  for (const std::string& name : listCameras()) uris.push_back(fmt::format("{}{}", kScheme, name));
  return uris;
}

}  // namespace

Driver row() {
  return {
      .name = About::name, .summary = About::summary, .list = list, .open = open, .document = [] {
        return settings::markdownTable(settings::keysOf<Keys>());
      }};
}

}  // namespace toftwin::drivers::aravis
