// SPDX-License-Identifier: Apache-2.0
#include "drivers/lens.h"

#include <fmt/format.h>

#include <cmath>

#include "calib/file/calibration_file.h"
#include "sim/images/content_hash.h"

namespace toftwin::drivers {
namespace {

constexpr Angle kStandInFieldOfView = 60_deg;

std::string idOf(const CameraInfo& c, std::string_view driver) {
  const auto& d = c.distortion;
  return sim::contentHash(fmt::format("{} {} {} {} {} {} {} {} {} {} {} {}", driver, c.width,
                                      c.height, c.fx, c.fy, c.cx, c.cy, d[0], d[1], d[2], d[3],
                                      d[4]));
}

CameraInfo fromFieldOfView(Angle horizontal, int width, int height) {
  const double fx = width / (2.0 * std::tan(horizontal.in(radian) / 2.0));
  return {.width = width,
          .height = height,
          .fx = fx,
          .fy = fx,
          .cx = (width - 1) / 2.0,
          .cy = (height - 1) / 2.0,
          .distortion = {},
          .calibration_id = {}};
}

}  // namespace

LensKeys inPixels(const LensKeys& keys) {
  if (keys.fx > 0.0 || keys.field_of_view <= 0_deg || keys.width == 0) return keys;
  const CameraInfo camera = fromFieldOfView(keys.field_of_view, keys.width, keys.height);
  return {.width = keys.width,
          .height = keys.height,
          .fx = camera.fx,
          .fy = camera.fy,
          .cx = camera.cx,
          .cy = camera.cy};
}

Result<Lens> lensFor(const LensKeys& keys, int width, int height, std::string_view driver) {
  const bool has_size = keys.width > 0;
  const double scale = has_size ? static_cast<double>(width) / keys.width : 1.0;
  if (has_size && std::lround(scale * keys.height) != height) {
    return Error{Error::Code::Incompatible,
                 fmt::format("{}: the lens is described for {} x {} pixels, which is not the "
                             "shape of the depth image, {} x {}",
                             driver, keys.width, keys.height, width, height)};
  }
  Lens lens;
  lens.is_known = keys.fx > 0.0 || keys.field_of_view > 0_deg;
  if (keys.fx > 0.0) {
    // Pixels are binned: their outer edges, half a pixel from the centres, stay where they are.
    lens.camera = {.width = width,
                   .height = height,
                   .fx = scale * keys.fx,
                   .fy = scale * (keys.fy > 0.0 ? keys.fy : keys.fx),
                   .cx = scale * (keys.cx + 0.5) - 0.5,
                   .cy = scale * (keys.cy + 0.5) - 0.5,
                   .distortion = keys.distortion,
                   .calibration_id = {}};
  } else {
    lens.camera =
        fromFieldOfView(lens.is_known ? keys.field_of_view : kStandInFieldOfView, width, height);
  }
  if (lens.is_known) lens.camera.calibration_id = idOf(lens.camera, driver);
  return lens;
}

std::optional<CameraInfo> calibrationAt(settings::Table& table, const std::string& file) {
  if (file.empty()) return std::nullopt;
  const auto loaded = calibration::load(table.resolve(file));
  if (loaded) return calibration::cameraOf(loaded->lens);
  table.complain("calibration", fmt::format("= \"{}\": {}", file, loaded.error().message));
  return std::nullopt;
}

Result<Lens> lensFor(const CameraInfo& calibrated, int width, int height, std::string_view driver) {
  auto lens = lensFor(LensKeys{.width = calibrated.width,
                       .height = calibrated.height,
                       .fx = calibrated.fx,
                       .fy = calibrated.fy,
                       .cx = calibrated.cx,
                       .cy = calibrated.cy,
                       .distortion = calibrated.distortion},
                      width, height, driver);
  if (lens) lens->camera.calibration_id = calibration::idOf(lens->camera);
  return lens;
}

Image<float> depthPerRange(const CameraInfo& camera) {
  Image<float> image{camera.width, camera.height};
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      image(x, y) = static_cast<float>(rayThroughPixel(camera, x, y).v.z);
    }
  }
  return image;
}

}  // namespace toftwin::drivers
