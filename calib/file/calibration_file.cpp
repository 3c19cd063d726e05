// SPDX-License-Identifier: Apache-2.0
#include "calib/file/calibration_file.h"

#include <fmt/format.h>

#include <cstdlib>
#include <string_view>

#include "protocol/settings/describe.h"
#include "protocol/settings/settings.h"
#include "sim/images/content_hash.h"

namespace toftwin::calibration {
namespace {

/// "[calibration.interval]" of "calibration.interval.fx".
std::string_view tableOf(std::string_view key) {
  const std::size_t dot = key.rfind('.');
  return dot == std::string_view::npos ? std::string_view{} : key.substr(0, dot);
}

}  // namespace

std::string idOf(const CameraInfo& c) {
  const auto& d = c.distortion;
  return sim::contentHash(fmt::format("lens {} {} {} {} {} {} {} {} {} {} {}", c.width, c.height, c.fx, c.fy,
                                      c.cx, c.cy, d[0], d[1], d[2], d[3], d[4]));
}

CameraInfo cameraOf(const LensTable& lens) {
  CameraInfo camera{.width = lens.width,
                    .height = lens.height,
                    .fx = lens.fx,
                    .fy = lens.fy,
                    .cx = lens.cx,
                    .cy = lens.cy,
                    .distortion = lens.distortion,
                    .calibration_id = {}};
  camera.calibration_id = idOf(camera);
  return camera;
}

Result<CalibrationFile> load(const std::filesystem::path& path) {
  auto table = settings::Table::load(path);
  if (!table) return table.error();
  CalibrationFile file;
  table->read(file);
  if (!table->has("lens")) table->complain("", "has no [lens]; it is no file of `toftwin calibrate`");
  if (file.lens.width == 0 || file.lens.height == 0 || file.lens.fx <= 0.0 || file.lens.fy <= 0.0) {
    table->complain("lens", "lacks width, height, fx or fy");
  }
  const std::string id = cameraOf(file.lens).calibration_id;
  if (!file.calibration.id.empty() && file.calibration.id != id) {
    table->complain("calibration", fmt::format("has the id {}, but its numbers have {}: [lens] was changed "
                                               "afterwards. Leave the id out to use it all the same",
                                               file.calibration.id, id));
  }
  if (auto checked = table->check(); !checked) return checked.error();
  return file;
}

std::string toText(CalibrationFile file) {
  file.calibration.id = cameraOf(file.lens).calibration_id;
  std::string text, table;
  for (const settings::Key& key : settings::keysOf(file)) {
    if (const auto here = tableOf(key.name); here != table) {
      text += fmt::format("{}[{}]\n", text.empty() ? "" : "\n", here);
      table = here;
    }
    text += fmt::format("{} = {}\n", key.name.substr(table.size() + 1), key.value);
  }
  return text;
}

std::filesystem::path storeFolder() {
  const char* data = std::getenv("XDG_DATA_HOME");
  if (data != nullptr && *data == '/') return std::filesystem::path{data} / "toftwin" / "calibrations";
  const char* home = std::getenv("HOME");
  if (home == nullptr || *home == '\0') return {};
  return std::filesystem::path{home} / ".local" / "share" / "toftwin" / "calibrations";
}

}  // namespace toftwin::calibration
