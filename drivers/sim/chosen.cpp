// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/chosen.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include <toftwin/names.h>

#include "drivers/lens.h"
#include "drivers/sim/default_scene.h"
#include "protocol/settings/endable.h"
#include "sim/sensor/frame_assembly.h"

namespace toftwin::drivers::simulator {

Result<> exposuresFit(const sim::SensorModel& model, Duration frame_interval) {
  if (model.exposureTime() <= frame_interval) return {};
  return Error{Error::Code::InvalidArgument,
               fmt::format("the raw exposures of a frame take {:.6g} ms, more than the frame "
                           "interval of {:.6g} ms",
                           model.exposureTime().in(millisecond), frame_interval.in(millisecond))};
}

namespace {

std::vector<PlaneKind> chosenPlanes(const Keys& keys, settings::Table& table) {
  const auto all = sim::allPlanes();
  if (keys.planes.empty()) return {all.begin(), all.begin() + kDefaultPlanes};
  std::vector<PlaneKind> chosen;
  for (const std::string& name : keys.planes) {
    const auto kind = planeKindNamed(name);
    if (!kind || std::ranges::find(all, *kind) == all.end()) {
      std::string known;
      for (PlaneKind plane : all) known += (known.empty() ? "" : ", ") + std::string{nameOf(plane)};
      table.complain("planes",
                     fmt::format("names \"{}\", but a simulated camera has only: {}{}", name, known, otherWordFor(name)));
    } else if (std::ranges::find(chosen, *kind) == chosen.end()) {
      chosen.push_back(*kind);
    }
  }
  return chosen;
}

/// Nothing after complaining: a preset or a file that is missing will not come by itself, as a camera
/// may, so it is a mistake in the configuration.
std::optional<sim::SensorModel> chosenCamera(const Keys& keys, settings::Table& table) {
  if (!keys.camera.empty()) {
    if (table.has("uri")) {
      table.complain("uri", fmt::format("= \"{}\" has no meaning beside camera = \"{}\": remove one of "
                                        "the two",
                                        keys.uri, keys.camera));
    }
    auto model = sim::SensorModel::load(table.resolve(keys.camera));
    if (model) return *std::move(model);
    table.complain("camera", fmt::format("= \"{}\": {}", keys.camera, model.error().message));
    return std::nullopt;
  }
  constexpr std::string_view kScheme = "sim:";
  if (keys.uri.starts_with(kScheme)) {
    if (auto model = sim::SensorModel::preset(keys.uri.substr(kScheme.size())))
      return *std::move(model);
  }
  std::string known;
  for (const std::string& name : sim::SensorModel::presetNames())
    known += (known.empty() ? "sim:" : ", sim:") + name;
  table.complain("uri", fmt::format("= \"{}\": there is no such preset; there are {}, and any "
                                    "camera file by the key camera",
                                    keys.uri, known));
  return std::nullopt;
}

/// The same camera with the calibrated lens, if the keys name one.
sim::SensorModel withCalibration(sim::SensorModel model, const Keys& keys, settings::Table& table) {
  const auto calibrated = calibrationAt(table, keys.calibration);
  if (!calibrated) return model;
  const CameraInfo& own = model.camera();
  const auto lens = lensFor(*calibrated, own.width, own.height, "sim");
  if (lens) return model.withLens(lens->camera);
  table.complain("calibration", fmt::format("= \"{}\": {}", keys.calibration, lens.error().message));
  return model;
}

sim::SceneLoading loadingOf(const Keys& keys) {
  return {.stop = settings::EndableReading::now(), .may_convert = keys.convert_meshes};
}

std::optional<sim::Scene> chosenScene(const Keys& keys, settings::Table& table) {
  auto scene = keys.scene.empty() ? sim::Scene::parse(kDefaultScene, "default scene")
                                  : sim::Scene::load(table.resolve(keys.scene), sim::Band::Infrared, loadingOf(keys));
  if (scene) return *std::move(scene);
  table.complain("scene", fmt::format("= \"{}\": {}", keys.scene, scene.error().message));
  return std::nullopt;
}

bool wantsColor(const std::vector<PlaneKind>& planes) { return std::ranges::count(planes, PlaneKind::Color) > 0; }

/// Nothing if no colours are wanted, or after complaining.
std::optional<ColorView> chosenColor(const Keys& keys, const sim::SensorModel& model, settings::Table& table) {
  auto visible = keys.scene.empty() ? sim::parseVisible(kDefaultScene, "default scene")
                                    : sim::loadVisible(table.resolve(keys.scene), loadingOf(keys));
  if (!visible) {
    table.complain("scene", fmt::format("= \"{}\": {}", keys.scene, visible.error().message));
    return std::nullopt;
  }
  return ColorView{*std::move(visible), {.lenses = *model.colorLens(),
                                         .world_from_camera = {},
                                         .samples_per_pixel = keys.samples_per_pixel,
                                         .max_surfaces = keys.max_surfaces,
                                         .seed = keys.seed}};
}

void complainOfMode(const Keys& keys, const std::optional<sim::SensorModel>& model,
                    const std::optional<sim::Scene>& scene, const std::vector<PlaneKind>& planes,
                    settings::Table& table) {
  if (keys.mode != Mode::RealTime) return;
  const auto complain = [&](std::string_view why) {
    table.complain("mode", fmt::format("= \"realtime\" cannot have {}: leave it out for \"unbiased\"", why));
  };
  if (model && !model->hasPhasors()) complain(fmt::format("a pulsed camera, as {} is", model->model()));
  if (model && model->rowDelay() > 0_ms) complain("a rolling shutter");
  if (wantsColor(planes)) complain("colours");
  if (scene && !scene->foreignEmitters().empty()) complain("other cameras' light, as the scene has");
}

}  // namespace

Result<Chosen> choose(settings::Table& table) {
  Keys keys;
  table.read(keys);
  std::vector<PlaneKind> planes = chosenPlanes(keys, table);
  auto model = chosenCamera(keys, table);
  if (model) model = withCalibration(*std::move(model), keys, table);
  auto scene = chosenScene(keys, table);
  if (model && keys.frame_interval > 0_ms) {
    if (auto fits = exposuresFit(*model, keys.frame_interval); !fits)
      table.complain("frame_interval_ms", fmt::format("is too short: {}", fits.error().message));
  }
  for (PlaneKind kind : planes) {
    if (!model || std::ranges::count(sim::planesOfCamera(*model), kind) > 0) continue;
    table.complain("planes", fmt::format("names \"{}\", which {} does not have", nameOf(kind), model->model()));
  }
  complainOfMode(keys, model, scene, planes, table);
  if (model && keys.light_noise > 0_mm && !model->hasPhasors()) {
    table.complain("light_noise_mm", fmt::format("cannot be had of a pulsed camera, as {} is: leave it out", model->model()));
  }
  std::optional<ColorView> color;
  if (model && scene && model->colorLens() && wantsColor(planes)) color = chosenColor(keys, *model, table);
  if (auto checked = table.check(); !checked) return checked.error();
  return Chosen{std::move(keys), *std::move(model), *std::move(scene), std::move(planes), std::move(color)};
}

}  // namespace toftwin::drivers::simulator
