// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>

#include "drivers/sim/default_scene.h"
#include "drivers/sim/keys.h"
#include "sim/sensor/frame_assembly.h"
#include "sim/sensor/sensor_model.h"
#include "sim/tracer/scene.h"
#include "sim/tracer/trace.h"
#include "tools/cli/command.h"
#include "tools/cli/options.h"
#include "tools/cli/pose.h"
#include "tools/cli/render_bands.h"
#include "tools/cli/render_images.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace {

/// As a [[source]] with driver = "sim", whose defaults these are.
struct Options {
  OutputOptions output;
  PoseOptions pose;
  std::string scene;
  std::string camera;
  drivers::simulator::Keys keys;
  double since_power_on_s = drivers::simulator::Keys{}.powered_on_before.in(second);
  double ambient_klx = drivers::simulator::Keys{}.ambient.in(kilolux);
  double room_temperature_c = drivers::simulator::Keys{}.room_temperature.in(celsius);
  std::uint64_t frame = 0;
  bool images = false;
};

Result<sim::SensorModel> loadCamera(const std::string& camera) {
  return std::filesystem::path{camera}.extension() == ".toml" ? sim::SensorModel::load(camera)
                                                              : sim::SensorModel::preset(camera);
}

std::string presetHelp() {
  return fmt::format("a preset ({}), or a camera file (.toml)",
                     fmt::join(sim::SensorModel::presetNames(), ", "));
}

Result<sim::Scene> loadScene(const std::string& scene) {
  return scene.empty() ? sim::Scene::parse(drivers::simulator::kDefaultScene, "default scene")
                       : sim::Scene::load(scene);
}

/// Those of a simulated source, and what was asked for besides.
std::vector<PlaneKind> planesFor(const sim::SensorModel& model,
                                 const std::vector<PlaneKind>& wanted) {
  const auto all = sim::planesOfCamera(model);
  std::vector<PlaneKind> kinds{all.begin(), all.begin() + drivers::simulator::kDefaultPlanes};
  for (const PlaneKind kind : wanted) {
    const bool is_new = std::ranges::find(kinds, kind) == kinds.end();
    if (is_new && std::ranges::find(all, kind) != all.end()) kinds.push_back(kind);
  }
  return kinds;
}

sim::TraceRequest requestFor(const Options& options, const sim::SensorModel& model,
                             const Transform<World, Camera>& pose) {
  sim::TraceRequest request = model.traceRequest();
  request.world_from_camera = pose;
  request.samples_per_pixel = options.keys.samples_per_pixel;
  request.max_surfaces = options.keys.max_surfaces;
  request.pixel_extent = options.keys.pixel_extent;
  request.seed = options.keys.seed;
  return request;
}

Moment momentFor(const Options& options, const sim::SensorModel& model,
                 const Transform<World, Camera>& pose) {
  Moment moment;
  moment.exposures = model.exposures({});
  moment.since_power_on = options.since_power_on_s * second;
  const Temperature room = options.room_temperature_c * celsius;
  moment.temperatures = model.temperatures(room, *moment.since_power_on);
  moment.temperatures.push_back({"room", room});
  moment.ambient = options.ambient_klx * kilolux;
  moment.world_from_camera = pose;
  return moment;
}

Result<Exit> run(Options& options) {
  const auto model = loadCamera(options.camera);
  if (!model) return model.error();
  const auto scene = loadScene(options.scene);
  if (!scene) return scene.error();
  const auto pose = options.pose.pose();
  if (!pose) return pose.error();
  catchInterrupts();
  const auto light = traceInBands(*scene, requestFor(options, *model, *pose));
  if (!light) return light.error();

  Frame frame;
  frame.source = model->model();
  frame.moment = momentFor(options, *model, *pose);
  frame.camera = model->camera();
  frame.provenance = sim::provenanceOf(*model, scene->id(), options.keys.seed);
  frame.planes =
      sim::planesOf(*model, model->expose(*light, frame.moment, options.keys.seed, options.frame),
                    light->truth, planesFor(*model, options.output.how.planes));
  const auto note = exportFrame(frame, options.output.file, options.output.how);
  if (!note) return note.error();
  fmt::print("{}: {}\n", options.output.file, *note);
  if (options.images) return renderImages(frame, *model, options.scene, options.output.file, options.keys);
  return Exit::Ok;
}

}  // namespace

Command renderCommand() {
  return {
      "render", "one frame of the simulator, without a daemon; defaults as of a simulated source",
      "  toftwin render --camera kinect_v2 -o range.png\n"
      "  toftwin render --camera my_camera.toml --scene room.toml -o cloud.ply --position 0,0,-1 "
      "--look-at 0,0,2\n"
      "  toftwin render --camera kinect_v2 --scene room.toml -o truth.npy --plane truth_range\n"
      "  toftwin render --camera kinect_v2 --samples 64 -o raw.npy --plane samples\n"
      "  toftwin render --camera kinect_v2 --scene desk.toml --samples 64 --images -o desk.png\n",
      [](CLI::App& app) -> Run {
        const auto options = std::make_shared<Options>();
        app.add_option("--camera", options->camera, presetHelp())->required();
        app.add_option("--scene", options->scene,
                       "scene file (.toml); default: a box before a wall");
        options->output.add(app, true);
        options->pose.add(app);
        app.add_option("--samples", options->keys.samples_per_pixel, "light paths per pixel")
            ->check(CLI::Range(1, 65'536))
            ->capture_default_str();
        app.add_option("--surfaces", options->keys.max_surfaces,
                       "surfaces that a path may meet; 1: direct light only")
            ->check(CLI::Range(1, 64))
            ->capture_default_str();
        app.add_option(
               "--pixel-extent", options->keys.pixel_extent,
               "side of a pixel's footprint in pixels; 0: its central ray, no flying pixels")
            ->check(CLI::Range(0.0, 4.0))
            ->capture_default_str();
        app.add_option("--seed", options->keys.seed, "of the light paths and the noise")
            ->capture_default_str();
        app.add_option("--frame", options->frame,
                       "number of the frame: another one has other noise")
            ->capture_default_str();
        app.add_option("--since-power-on", options->since_power_on_s,
                       "seconds that the camera has been on")
            ->check(CLI::NonNegativeNumber)
            ->capture_default_str();
        app.add_option("--ambient-klx", options->ambient_klx,
                       "ambient light at the scene, in kilolux")
            ->check(CLI::Range(0.0, 200.0))
            ->capture_default_str();
        app.add_option("--room-temperature-c", options->room_temperature_c, "in degrees Celsius")
            ->check(CLI::Range(-40.0, 100.0))
            ->capture_default_str();
        app.add_flag("--images", options->images,
                     "also FILE-infrared.png and FILE-depth.png as pictures to look at, and, for a camera with a "
                     "colour lens, FILE-color.png from its place, FILE-color-in-depth.png and "
                     "FILE-depth-in-color.png");
        checkUsage(app, [options] { return options->output.check(); });
        return [options] { return run(*options); };
      }};
}

}  // namespace toftwin::cli
