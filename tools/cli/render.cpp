// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "sim/sensor/sensor_model.h"
#include "sim/tracer/scene.h"
#include "sim/tracer/trace.h"
#include "tools/cli/command.h"
#include "tools/cli/options.h"
#include "tools/cli/pose.h"
#include "tools/cli/render_bands.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace {

struct Options {
  OutputOptions output;
  std::string camera;
  std::string scene;
  std::vector<double> position_m{0.0, 0.0, 0.0};
  std::vector<double> look_at_m;
  std::vector<double> up{0.0, -1.0, 0.0};
  int samples = 16;
  int surfaces = 16;
  std::uint64_t seed = 0;
  std::uint64_t frame = 0;
  double since_power_on_s = 3600.0;
  std::optional<double> ambient_klx;
};

Result<sim::SensorModel> loadCamera(const std::string& camera) {
  return std::filesystem::path{camera}.extension() == ".toml" ? sim::SensorModel::load(camera)
                                                              : sim::SensorModel::preset(camera);
}

std::string presetHelp() {
  return fmt::format("a preset ({}), or a camera file (.toml)",
                     fmt::join(sim::SensorModel::presetNames(), ", "));
}

Plane normalsOf(const Image<Vec3f>& normal) {
  std::vector<float> planar(3 * normal.size());
  for (std::size_t i = 0; i < normal.size(); ++i) {
    planar[i] = normal[i].x;
    planar[normal.size() + i] = normal[i].y;
    planar[2 * normal.size() + i] = normal[i].z;
  }
  return {PlaneKind::TruthNormal,          ElementType::F32, normal.width(), normal.height(), 3,
          Buffer::adopt(std::move(planar))};
}

Frame frameOf(const sim::SensorModel& model, const sim::Scene& scene, const Moment& moment,
              std::uint64_t seed, sim::SensorModel::Exposed exposed, sim::Truth truth) {
  Frame frame;
  frame.source = model.model();
  frame.moment = moment;
  frame.camera = model.camera();
  frame.provenance = {
      FrameKind::Simulated, model.camera().calibration_id, scene.id(), model.id(), seed,
      model.effectNames()};
  frame.planes = {toPlane(PlaneKind::Range, std::move(exposed.range.range_m)),
                  toPlane(PlaneKind::Amplitude, std::move(exposed.range.amplitude)),
                  toPlane(PlaneKind::Ambient, std::move(exposed.range.ambient)),
                  toPlane(PlaneKind::Flags, std::move(exposed.range.flags)),
                  toPlane(PlaneKind::TruthRange, std::move(truth.range_m)),
                  normalsOf(truth.normal)};
  return frame;
}

Result<Exit> run(Options& options) {
  if (auto checked = options.output.check(); !checked) return checked.error();
  const auto model = loadCamera(options.camera);
  if (!model) return model.error();
  const auto scene = sim::Scene::load(options.scene);
  if (!scene) return scene.error();
  const auto pose = lookFrom(options.position_m, options.look_at_m, options.up);
  if (!pose) return pose.error();

  sim::TraceRequest request = model->traceRequest();
  request.world_from_camera = *pose;
  request.samples_per_pixel = options.samples;
  request.max_surfaces = options.surfaces;
  request.seed = options.seed;
  catchInterrupts();
  auto light = traceInBands(*scene, request);
  if (!light) return light.error();

  Moment moment;
  moment.exposures = model->exposures({});
  if (options.ambient_klx) moment.ambient = *options.ambient_klx * kilolux;
  moment.since_power_on = options.since_power_on_s * second;
  moment.world_from_camera = *pose;
  auto exposed = model->expose(*light, moment, options.seed, options.frame);
  const Frame frame =
      frameOf(*model, *scene, moment, options.seed, std::move(exposed), std::move(light->truth));
  const auto note = exportFrame(frame, options.output.file, options.output.how);
  if (!note) return note.error();
  fmt::print("{}: {}\n", options.output.file, *note);
  return Exit::Ok;
}

}  // namespace

Command renderCommand() {
  return {
      "render", "one frame of the simulator, without a daemon",
      "  toftwin render --camera kinect_v2 --scene room.toml -o range.png\n"
      "  toftwin render --camera my_camera.toml --scene room.toml -o cloud.ply --position 0,0,-1 "
      "--look-at 0,0,2\n"
      "  toftwin render --camera kinect_v2 --scene room.toml -o truth.npy --plane truth_range\n",
      [](CLI::App& app) -> Run {
        const auto options = std::make_shared<Options>();
        app.add_option("--camera", options->camera, presetHelp())->required();
        app.add_option("--scene", options->scene, "scene file (.toml)")->required();
        options->output.add(app, true);
        app.add_option("--position", options->position_m,
                       "place of the camera in the world: X,Y,Z in metres")
            ->delimiter(',')
            ->expected(3);
        app.add_option(
               "--look-at", options->look_at_m,
               "a point on the camera's axis: X,Y,Z in metres; default: along the world's z")
            ->delimiter(',')
            ->expected(3);
        app.add_option("--up", options->up,
                       "what is up in the world, for --look-at; default: 0,-1,0")
            ->delimiter(',')
            ->expected(3);
        app.add_option("--samples", options->samples, "light paths per pixel")
            ->check(CLI::Range(1, 1'000'000))
            ->capture_default_str();
        app.add_option("--surfaces", options->surfaces,
                       "surfaces that a path may meet; 1: direct light only")
            ->check(CLI::Range(1, 1000))
            ->capture_default_str();
        app.add_option("--seed", options->seed, "of the light paths and the noise")
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
            ->check(CLI::NonNegativeNumber);
        return [options] { return run(*options); };
      }};
}

}  // namespace toftwin::cli
