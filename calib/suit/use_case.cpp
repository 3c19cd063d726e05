// SPDX-License-Identifier: Apache-2.0
#include "calib/suit/use_case.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "protocol/settings/describe.h"
#include "protocol/settings/settings.h"
#include "sim/sensor/sensor_model.h"

namespace toftwin::suit {
namespace {

using settings::Table;

struct KindName {
  Kind kind;
  const char* name;
  std::vector<std::string> needs;  ///< keys without which it says nothing
  std::vector<std::string> takes;  ///< keys that mean something besides
};

const std::vector<KindName>& kinds() {
  static const std::vector<KindName> kKinds{
      {Kind::Accuracy, "accuracy", {"within_mm", "at_least_percent"}, {}},
      {Kind::Bias, "bias", {"at_most_mm"}, {}},
      {Kind::Noise, "noise", {"at_most_mm"}, {}},
      {Kind::Valid, "valid", {"at_least_percent"}, {}},
      {Kind::Missed, "missed", {"within_mm", "at_most_percent"}, {"pixels"}},
      {Kind::Phantom, "phantom", {"within_mm", "at_most_percent"}, {}},
      {Kind::Pixels, "pixels", {"at_least_pixels"}, {}},
      {Kind::FrameRate, "frame_rate", {"at_least_hz"}, {}}};
  return kKinds;
}

const KindName& rowOf(Kind kind) { return *std::ranges::find(kinds(), kind, &KindName::kind); }

/// A key that was written without its unit gets a better answer than "unknown".
void complainOfUnits(Table& table) {
  for (const auto& [bare, units] : {std::pair{"within", "within_mm"},
                                    {"at_most", "at_most_mm or at_most_percent"},
                                    {"at_least", "at_least_percent, at_least_pixels or at_least_hz"},
                                    {"tolerance", "within_mm"},
                                    {"fps", "at_least_hz"}}) {
    if (table.has(bare)) table.complain(bare, fmt::format("has no unit: write {}", units));
  }
}

/// Asked first and alone, because to the reader such a key is just unknown.
Result<> checkUnits(const Table& whole) {
  Table table = whole.anew();
  table.acceptAll();
  if (!table.has("require")) return {};
  for (Table& one : table.tables("require")) {
    one.acceptAll();
    complainOfUnits(one);
  }
  return table.check();
}

void checkKeys(const RequirementSpec& one, Table& table) {
  const KindName& kind = rowOf(one.kind);
  for (const std::string& key : kind.needs) {
    if (!table.has(key)) table.complain("", fmt::format("is of kind \"{}\" and must say {}", kind.name, key));
  }
  for (const char* key : {"within_mm", "at_least_percent", "at_most_percent", "at_most_mm", "pixels",
                          "at_least_pixels", "at_least_hz"}) {
    const auto isIn = [&](const auto& list) { return std::ranges::find(list, key) != list.end(); };
    if (table.has(key) && !isIn(kind.needs) && !isIn(kind.takes))
      table.complain(key, fmt::format("has no meaning for kind = \"{}\"", kind.name));
  }
  if (one.kind == Kind::FrameRate) {
    for (const char* key : {"object", "region", "poses", "lightings"}) {
      if (table.has(key)) table.complain(key, "has no meaning for a frame rate");
    }
  }
  if (!one.object.empty() && !one.region.empty())
    table.complain("region", "stands beside object: say which pixels one way");
  if ((one.kind == Kind::Missed || one.kind == Kind::Pixels) && one.object.empty() && one.region.empty())
    table.complain("", fmt::format("is of kind \"{}\" and must say of which object or region", kind.name));
}

template <class Specs>
std::vector<std::string> namesOf(const Specs& specs) {
  std::vector<std::string> names;
  for (const auto& one : specs) names.push_back(one.name);
  return names;
}

void checkName(Table& table, const char* key, const std::string& name, const std::vector<std::string>& known,
               const char* what) {
  if (std::ranges::find(known, name) != known.end()) return;
  std::set<std::string> once{known.begin(), known.end()};
  once.erase("");
  table.complain(key, fmt::format("names \"{}\", which is no {}; there {}", name, what,
                                  once.empty() ? "are none" : fmt::format("are: {}", fmt::join(once, ", "))));
}

/// Each must have a name of its own; gives the tables, all keys ticked off.
std::vector<Table> checkedNames(Table& table, const char* key, const std::vector<std::string>& names) {
  auto tables = table.has(key) ? table.tables(key) : std::vector<Table>{};
  for (Table& one : tables) one.acceptAll();
  std::set<std::string> once;
  for (std::size_t i = 0; i < std::min(tables.size(), names.size()); ++i) {
    if (names[i].empty()) tables[i].complain("", fmt::format("is a [[{}]] without a name", key));
    if (!names[i].empty() && !once.insert(names[i]).second)
      tables[i].complain("name", fmt::format("= \"{}\": another [[{}]] is called so", names[i], key));
  }
  return tables;
}

void checkRequirements(const Case& one, std::vector<Table>& tables) {
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const RequirementSpec& r = one.spec.requirements[i];
    checkKeys(r, tables[i]);
    if (!r.object.empty()) checkName(tables[i], "object", r.object, one.object_names, "object of the scene");
    if (!r.region.empty()) checkName(tables[i], "region", r.region, namesOf(one.spec.regions), "[[region]]");
    for (const auto& name : r.poses) checkName(tables[i], "poses", name, namesOf(one.spec.poses), "[[pose]]");
    for (const auto& name : r.lightings)
      checkName(tables[i], "lightings", name, namesOf(one.spec.lightings), "[[lighting]]");
  }
}

void checkCamera(const Case& one, const CameraSpec& camera, Table& table) {
  if (camera.models.empty() == camera.recording.empty())
    table.complain("", "is a [[camera]] that must have either models or a recording");
  for (const std::string& model : camera.models) {
    if (std::filesystem::path{model}.extension() == ".toml") {
      if (!std::filesystem::exists(one.resolve(model)))
        table.complain("models", fmt::format("names {}, which is not there", one.resolve(model).string()));
    } else if (const auto text = sim::SensorModel::presetText(model); !text) {
      table.complain("models", fmt::format("names \"{}\": {}", model, text.error().message));
    }
  }
  const bool is_recording = !camera.recording.empty();
  for (const char* key : {"pose", "lighting"}) {
    if (table.has(key) && !is_recording) table.complain(key, "has a meaning for recordings only");
  }
  if (table.has("exposure_factors") && is_recording)
    table.complain("exposure_factors", "has no meaning for a recording: it was exposed as it was");
  if (!camera.pose.empty()) checkName(table, "pose", camera.pose, namesOf(one.spec.poses), "[[pose]]");
  if (!camera.lighting.empty())
    checkName(table, "lighting", camera.lighting, namesOf(one.spec.lightings), "[[lighting]]");
  if (is_recording && camera.lighting.empty() && one.spec.lightings.size() > 1)
    table.complain("", "is a recording and must say its lighting, for there are several");
}

void checkPlaces(const Case& one, std::vector<Table>& poses, std::vector<Table>& regions) {
  for (std::size_t i = 0; i < poses.size(); ++i) {
    double squares = 0.0;
    for (const double q : one.spec.poses[i].rotation_wxyz) squares += q * q;
    if (squares < 1e-12) poses[i].complain("rotation_wxyz", "is all zeros, which is no rotation");
    if (poses[i].has("rotation_wxyz") && poses[i].has("euler_deg"))
      poses[i].complain("euler_deg", "stands beside rotation_wxyz: say it one way");
  }
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const RegionSpec& r = one.spec.regions[i];
    for (std::size_t k = 0; k < 3; ++k) {
      if (r.lower_m[k] >= r.upper_m[k])
        regions[i].complain("upper_m",
                            fmt::format("must be above lower_m on every axis; on {} it is not", "xyz"[k]));
    }
  }
}

/// The scene's names; nothing where it cannot be read, and then a complaint.
void loadNames(Case& one, Table& table) {
  if (one.spec.scene.empty()) {
    table.complain("", "must name a scene file: scene = …");
    return;
  }
  one.scene_file = one.resolve(one.spec.scene);
  const auto scene = sim::loadSceneFile(one.scene_file);
  if (!scene) {
    table.complain("scene", fmt::format("cannot be used: {}", scene.error().message));
    return;
  }
  for (const auto& object : scene->spec.objects) one.object_names.push_back(object.name);
}

Result<Case> read(Table table, const std::filesystem::path& file) {
  Case one{.spec = {},
           .file = file,
           .scene_file = {},
           .object_names = {},
           .camera_places = {},
           .requirement_places = {}};
  if (auto units = checkUnits(table); !units) return units.error();
  table.read(one.spec);
  auto poses = checkedNames(table, "pose", namesOf(one.spec.poses));
  checkedNames(table, "lighting", namesOf(one.spec.lightings));
  auto regions = checkedNames(table, "region", namesOf(one.spec.regions));
  auto requirements = checkedNames(table, "require", namesOf(one.spec.requirements));
  auto cameras = table.has("camera") ? table.tables("camera") : std::vector<Table>{};
  for (Table& camera : cameras) camera.acceptAll();
  if (poses.empty()) table.complain("", "has no [[pose]]: where is the camera?");
  if (requirements.empty()) table.complain("", "has no [[require]]: what must the camera do?");
  if (one.spec.lightings.empty()) one.spec.lightings.push_back({.name = "dark"});
  loadNames(one, table);
  checkPlaces(one, poses, regions);
  checkRequirements(one, requirements);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    checkCamera(one, one.spec.cameras[i], cameras[i]);
    one.camera_places.push_back(cameras[i].place());
  }
  for (Table& r : requirements) one.requirement_places.push_back(r.place());
  if (auto checked = table.check(); !checked) return checked.error();
  for (CameraSpec& camera : one.spec.cameras) {
    if (camera.name.empty())
      camera.name = camera.recording.empty() ? camera.models.front() : camera.recording;
  }
  if (one.spec.cameras.empty()) one.spec.cameras = presetCameras();
  one.camera_places.resize(one.spec.cameras.size());
  return one;
}

}  // namespace

std::filesystem::path Case::resolve(const std::string& path) const {
  const std::filesystem::path wanted{path};
  return wanted.is_absolute() ? wanted : file.parent_path() / wanted;
}

std::string_view nameOf(Kind kind) { return rowOf(kind).name; }

Result<Case> loadCase(const std::filesystem::path& file) {
  auto table = Table::load(file);
  return table ? read(*std::move(table), file) : table.error();
}

Result<Case> parseCase(std::string_view toml, const std::filesystem::path& name) {
  auto table = Table::parse(toml, name);
  return table ? read(*std::move(table), name) : table.error();
}

std::vector<CameraSpec> presetCameras() {
  const auto names = sim::SensorModel::presetNames();
  std::vector<CameraSpec> cameras;
  const auto isModeOf = [](const std::string& name, const std::string& base) {
    return name.starts_with(base + "_");
  };
  for (const std::string& name : names) {
    if (std::ranges::any_of(names, [&](const std::string& base) { return isModeOf(name, base); })) continue;
    CameraSpec camera{.name = name, .models = {name}};
    for (const std::string& mode : names) {
      if (isModeOf(mode, name)) camera.models.push_back(mode);
    }
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

std::string documentCase() { return settings::markdownTable(settings::keysOf<UseCase>()); }

}  // namespace toftwin::suit
