// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/description.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/v4l2/pixel_format.h"
#include "protocol/settings/settings.h"
#include "sim/images/content_hash.h"

namespace toftwin::drivers::v4l2 {
namespace {

constexpr Angle kStandInFieldOfView = 60_deg;
constexpr std::string_view kUsb = "usb:", kCard = "card:";

void checkFormat(settings::Table& table, const char* group, const ImageKeys& image) {
  if (image.format.empty() || pixelFormatNamed(image.format) != nullptr) return;
  std::string known;
  for (const PixelFormat& one : allPixelFormats()) {
    known += (known.empty() ? "" : ", ") + std::string{one.name};
  }
  table.complain(
      group, fmt::format("names the format \"{}\", but must name one of: {}", image.format, known));
}

void checkCodes(settings::Table& table, const char* key, const std::vector<double>& codes) {
  for (const double code : codes) {
    if (code == std::floor(code)) continue;
    table.complain("depth", fmt::format("has {} = {}, but codes are whole numbers", key, code));
  }
}

Result<Description> read(settings::Table table) {
  Description description;
  table.read(description);
  checkFormat(table, "depth", description.depth);
  checkFormat(table, "infrared", description.infrared);
  checkCodes(table, "invalid", description.depth.invalid);
  checkCodes(table, "saturated", description.depth.saturated);
  for (const std::string& one : description.match) {
    if (!one.starts_with(kUsb) && !one.starts_with(kCard)) {
      table.complain("match",
                     fmt::format("has \"{}\", but each must begin with usb: or card:", one));
    }
  }
  const LensKeys& lens = description.lens;
  if ((lens.width == 0) != (lens.height == 0)) {
    table.complain("lens", "has only one of width and height; give both, or neither");
  }
  if (lens.fx > 0.0 && lens.field_of_view > 0_deg) {
    table.complain("lens", "has fx and field_of_view_deg, which say the same twice; leave one out");
  }
  if (auto checked = table.check(); !checked) return checked.error();
  return description;
}

std::string idOf(const CameraInfo& c) {
  const auto& d = c.distortion;
  return sim::contentHash(fmt::format("v4l2 {} {} {} {} {} {} {} {} {} {} {}", c.width, c.height,
                                      c.fx, c.fy, c.cx, c.cy, d[0], d[1], d[2], d[3], d[4]));
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

Result<Description> loadDescription(const std::filesystem::path& file) {
  auto table = settings::Table::load(file);
  if (!table) return table.error();
  return read(*std::move(table));
}

Result<Description> parseDescription(std::string_view toml, const std::string& name) {
  auto table = settings::Table::parse(toml, name);
  if (!table) return table.error();
  return read(*std::move(table));
}

bool matches(const Description& description, const std::string& usb_ids, const std::string& card) {
  return std::ranges::any_of(description.match, [&](const std::string& one) {
    return (!usb_ids.empty() && one == std::string{kUsb} + usb_ids) ||
           one == std::string{kCard} + card;
  });
}

Result<Lens> lensFor(const LensKeys& keys, int width, int height) {
  const bool has_size = keys.width > 0;
  const double scale = has_size ? static_cast<double>(width) / keys.width : 1.0;
  if (has_size && std::lround(scale * keys.height) != height) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("v4l2: the description's lens is for {} x {} pixels, which is not the "
                             "shape of the depth image, {} x {}",
                             keys.width, keys.height, width, height)};
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
  if (lens.is_known) lens.camera.calibration_id = idOf(lens.camera);
  return lens;
}

}  // namespace toftwin::drivers::v4l2
