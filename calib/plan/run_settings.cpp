// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/run_settings.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include <toftwin/names.h>

namespace toftwin::plan {
namespace {

/// The different values, ascending; those that are not known are left out.
std::string valuesOf(const std::set<double>& values) {
  std::string text;
  for (const double one : values) {
    if (std::isfinite(one)) text += fmt::format("{}{:.6g}", text.empty() ? "" : ", ", one);
  }
  return text;
}

}  // namespace

CameraName cameraNameOf(const std::string& text) {
  CameraName name;
  const auto comma = text.find(", ");
  name.source = text.substr(0, comma);
  if (comma == std::string::npos) return name;
  const std::string rest = text.substr(comma + 2);
  const auto space = rest.rfind(' ');
  name.model = rest.substr(0, space);
  if (space != std::string::npos) name.serial = rest.substr(space + 1);
  return name;
}

std::vector<RunSetting> settingsOf(const Plan& plan, const std::vector<std::string>& skipped,
                                   const std::vector<CaptureRecord>& records, std::size_t planned,
                                   const std::string& index_sha256) {
  std::set<double> exposures, ambients;
  std::set<std::string> poses_by;
  for (const CaptureRecord& one : records) {
    exposures.insert(one.exposure_us), ambients.insert(one.ambient_klx);
    if (!one.pose_by.empty()) poses_by.insert(one.pose_by);
  }
  return {{"", "plan", plan.name},
          {"", "plan_seed", std::to_string(plan.seed)},
          {"", "skipped", fmt::format("{}", fmt::join(skipped, ", "))},
          {"", "captures", std::to_string(records.size())},
          {"", "captures_planned", std::to_string(planned)},
          {"", "exposure_us", valuesOf(exposures)},
          {"", "ambient_klx", valuesOf(ambients)},
          {"", "pose_by", fmt::format("{}", fmt::join(poses_by, ", "))},
          {"", "index_sha256", index_sha256}};
}

std::vector<RunSetting> settingsOf(const char* of, const std::string& camera, const Frame& first) {
  const CameraName name = cameraNameOf(camera);
  const Provenance& from = first.provenance;
  std::set<double> frequencies;
  for (const Exposure& one : first.moment.exposures) {
    if (one.modulation.in(megahertz) > 0.0) frequencies.insert(one.modulation.in(megahertz));
  }
  return {{of, "source", name.source},
          {of, "model", name.model},
          {of, "serial", name.serial},
          {of, "frames", std::string{nameOf(from.kind)}},
          {of, "resolution_px", fmt::format("{} × {}", first.camera.width, first.camera.height)},
          {of, "frequency_mhz", valuesOf(frequencies)},
          {of, "calibration_id", from.calibration_id},
          {of, "scene_id", from.scene_id},
          {of, "model_id", from.model_id},
          {of, "seed", from.kind == FrameKind::Simulated ? std::to_string(from.seed) : ""},
          {of, "effects", fmt::format("{}", fmt::join(from.effects, ", "))}};
}

compare::TableBlock provenanceTable(const std::vector<RunSetting>& settings) {
  compare::TableBlock table{
      "What was compared, with what, and how; of the cameras as their first frames say it",
      {"", "A", "B"},
      {}};
  for (const RunSetting& one : settings) {
    if (one.value.empty()) continue;
    auto row = std::ranges::find_if(table.rows, [&](const auto& there) { return there[0] == one.name; });
    if (row == table.rows.end()) row = table.rows.insert(row, {one.name, "", ""});
    if (one.of != "B") (*row)[1] = one.value;
    if (one.of != "A") (*row)[2] = one.value;
  }
  return table;
}

compare::Json toJson(const std::vector<RunSetting>& settings) {
  compare::Json a = compare::Json::object(), b = compare::Json::object(), run = compare::Json::object();
  for (const RunSetting& one : settings)
    (one.of == "A" ? a : one.of == "B" ? b : run).set(one.name, one.value);
  compare::Json json = compare::Json::object();
  json.set("run", std::move(run)).set("a", std::move(a)).set("b", std::move(b));
  return json;
}

}  // namespace toftwin::plan
