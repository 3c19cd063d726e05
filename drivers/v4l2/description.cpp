// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/description.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/v4l2/pixel_format.h"
#include "protocol/settings/settings.h"

namespace toftwin::drivers::v4l2 {
namespace {

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

}  // namespace toftwin::drivers::v4l2
