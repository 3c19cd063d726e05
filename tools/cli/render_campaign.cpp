// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/render_campaign.h"

#include <fmt/format.h>

#include <algorithm>

#include <toftwin/names.h>

#include "drivers/sim/default_scene.h"
#include "protocol/types/counted.h"
#include "sim/images/content_hash.h"
#include "sim/sensor/color.h"
#include "sim/sensor/frame_assembly.h"
#include "sim/sensor/lens_off_axis.h"
#include "sim/tracer/missing_light.h"
#include "sim/tracer/objects.h"
#include "sim/tracer/scene.h"

namespace toftwin::cli {
namespace {

constexpr std::string_view kDefaultScene = drivers::simulator::kDefaultScene;
constexpr const char* kDefaultSceneName = "default scene";

/// Whoever renders by hand may have a mesh converted.
const sim::SceneLoading kLoading{.stop = {}, .may_convert = true};

Result<sim::SensorModel> loadCamera(const std::string& camera) {
  constexpr std::string_view kPreset = "preset:";  // as `toftwin info` names them
  if (std::filesystem::path{camera}.extension() == ".toml") return sim::SensorModel::load(camera);
  return sim::SensorModel::preset(camera.starts_with(kPreset) ? camera.substr(kPreset.size()) : camera);
}

Result<sim::Scene> loadScene(const std::string& scene) {
  return scene.empty() ? sim::Scene::parse(kDefaultScene, kDefaultSceneName) : sim::Scene::load(scene, sim::Band::Infrared, kLoading);
}

Result<sim::VisibleScene> loadVisibleScene(const std::string& scene) {
  return scene.empty() ? sim::parseVisible(kDefaultScene, kDefaultSceneName) : sim::loadVisible(scene, kLoading);
}

bool isIn(PlaneKind kind, const std::vector<PlaneKind>& kinds) {
  return std::ranges::find(kinds, kind) != kinds.end();
}

/// Those of a simulated source and what was asked for besides; of a campaign exactly what was asked for.
Result<std::vector<PlaneKind>> planesFor(const sim::SensorModel& model, const RenderOptions& options) {
  const std::vector<PlaneKind>& wanted = options.output.how.planes;
  const auto all = sim::planesOfCamera(model);
  const bool is_campaign = targetOf(options).kind != TargetKind::Frame;
  std::vector<PlaneKind> kinds{all.begin(), all.begin() + drivers::simulator::kDefaultPlanes};
  if (is_campaign && !wanted.empty()) kinds.clear();
  std::string names;
  for (const PlaneKind kind : all) names += (names.empty() ? "" : ", ") + std::string{nameOf(kind)};
  for (const PlaneKind kind : wanted) {
    if (!isIn(kind, all)) {
      return Error{Error::Code::NotFound, fmt::format("frames of {} have no plane {}; they have: {}",
                                                      model.model(), nameOf(kind), names)};
    }
    if (!isIn(kind, kinds)) kinds.push_back(kind);
  }
  return kinds;
}

/// A point cloud needs more than the planes that are written.
std::vector<PlaneKind> tracedPlanes(std::vector<PlaneKind> planes, const RenderOptions& options) {
  const bool is_ply = options.output.file.ends_with(".ply") ||
                      std::ranges::find(options.formats, Format::Ply) != options.formats.end();
  for (const PlaneKind kind : {PlaneKind::Range, PlaneKind::Amplitude}) {
    if (is_ply && !isIn(kind, planes)) planes.push_back(kind);
  }
  return planes;
}

/// Frames must not overlap: the next begins when the last raw exposure of this one is over.
Result<Duration> intervalOf(const sim::SensorModel& model, double wanted_ms) {
  if (wanted_ms == 0.0) return model.frameInterval();
  const Duration interval = wanted_ms * millisecond;
  if (model.exposureTime() <= interval) return interval;
  return Error{Error::Code::InvalidArgument,
               fmt::format("--frame-interval-ms {}: the raw exposures of a frame take {:.6g} ms", wanted_ms,
                           model.exposureTime().in(millisecond))};
}

std::string nameOfCamera(const RenderOptions& options) {
  return std::filesystem::path{options.camera}.stem().string();
}

/// Every bit of the numbers.
std::string hashOfPoses(const Trajectory& trajectory) {
  std::string text = trajectory.has_times ? "times\n" : "no times\n";
  for (const auto& pose : trajectory.poses) {
    const Vec3d& p = pose.position_m;
    text += fmt::format("{} {} {} {} {}\n", pose.time_s, p.x, p.y, p.z, fmt::join(pose.rotation_wxyz, " "));
  }
  return sim::contentHash(text);
}

std::string textOf(const Transform<World, Camera>& pose) {
  const Vec3d& p = pose.translation_m;
  return fmt::format("at {}, {}, {} m, turned by {} (w, x, y, z)", p.x, p.y, p.z,
                     fmt::join(pose.rotation_wxyz, ", "));
}

std::string namesOf(const std::vector<PlaneKind>& planes) {
  std::string names;
  for (const PlaneKind kind : planes) names += (names.empty() ? "" : ", ") + std::string{nameOf(kind)};
  return names;
}

Transform<World, Camera> firstPose(const Trajectory& trajectory) {
  return {trajectory.poses.front().rotation_wxyz, trajectory.poses.front().position_m};
}

/// Everything that the bytes of the output depend on.
std::vector<Input> inputsOf(const RenderOptions& options, const FrameMaker& maker,
                            const std::string& scene_id, const Trajectory& trajectory,
                            const std::vector<PlaneKind>& planes) {
  const RenderSettings& settings = options.settings;
  const ExportOptions& how = options.output.how;
  const auto number = [](auto value) { return fmt::format("{}", value); };
  const std::string scene = options.scene.empty() ? kDefaultSceneName : options.scene;
  std::vector<Input> inputs{{"toftwin", TOFTWIN_VERSION},
                            {"camera", maker.model().id(), options.camera},
                            {"scene", scene_id, scene},
                            {"frames", number(maker.schedule().frames)},
                            {"first_frame_at_ns", number(maker.schedule().start.ns)},
                            {"frame_interval_ns", number(maker.schedule().interval_ns)},
                            {"samples_per_pixel", number(settings.keys.samples_per_pixel)},
                            {"sampler", drivers::simulator::nameOf(settings.keys.sampler)},
                            {"light_noise_mm", number(settings.keys.light_noise.in(millimetre))},
                            {"max_surfaces", number(settings.keys.max_surfaces)},
                            {"pixel_extent", number(settings.keys.pixel_extent)},
                            {"seed", number(settings.keys.seed)},
                            {"first_frame", number(settings.first_noise)},
                            {"since_power_on_s", number(settings.since_power_on_s)},
                            {"ambient_klx", number(settings.ambient_klx)},
                            {"room_temperature_c", number(settings.room_temperature_c)},
                            {"freeze", number(settings.freeze)},
                            {"planes", namesOf(planes)}};
  if (trajectory.poses.empty())
    inputs.push_back({"pose", textOf(*options.pose.pose())});
  else
    inputs.push_back({"trajectory", hashOfPoses(trajectory), options.trajectory});
  std::string formats;
  for (const std::string& name : options.format_names) formats += (formats.empty() ? "" : ", ") + name;
  const auto maybe = [](const auto& value) { return value ? fmt::format("{}", *value) : "none"; };
  inputs.push_back(
      {"files", fmt::format("formats {}; channel {}, scale {} mm, colours {} from {} to {}, row {}, world {}",
                            formats.empty() ? "default" : formats, how.channel, how.mm_per_count, how.color,
                            maybe(how.min), maybe(how.max), maybe(how.row), how.world)});
  return inputs;
}

/// All that a campaign and a single frame have in common.
struct Job {
  FrameMaker maker;
  Trajectory trajectory;
  std::string scene_id;
  std::vector<PlaneKind> planes;  ///< to be written
};

Result<Job> jobOf(const RenderOptions& options) {
  auto model = loadCamera(options.camera);
  if (!model) return model.error();
  if (options.settings.keys.light_noise > Length{} && !model->hasPhasors()) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("--light-noise-mm cannot be had of a pulsed camera, as {} is: leave it out",
                             model->model())};
  }
  auto scene = loadScene(options.scene);
  if (!scene) return scene.error();
  if (const auto missing = sim::missingLight(*scene, model->traceRequest().emitters, false))
    options.tell(fmt::format("{}: warning: {}", options.scene, *missing));
  for (const std::string& note : model->notes()) options.tell("note: " + note);
  if (const auto off_axis = sim::lensOffAxis(model->camera()))
    options.tell(fmt::format("{}: warning: {}", options.camera, *off_axis));
  const auto pose = options.pose.pose();
  if (!pose) return pose.error();
  const auto warn = [&](const std::string& text) { options.tell(fmt::format("{}: warning: {}", options.scene, text)); };
  for (const std::string& note : scene->notes()) warn(note);
  auto trajectory = options.trajectory.empty() ? Result<Trajectory>{options.poses.value_or(Trajectory{})}
                                               : loadTrajectory(options.trajectory);
  if (!trajectory) return trajectory.error();
  const auto nothing = sim::seesNothing(*scene, model->camera(), trajectory->poses.empty() ? *pose : firstPose(*trajectory));
  if (nothing) warn(*nothing);
  const auto interval = intervalOf(*model, options.frame_interval_ms);
  if (!interval) return interval.error();
  const auto schedule = scheduleOf(*trajectory, options.frames, *interval);
  if (!schedule) return schedule.error();
  const auto planes = planesFor(*model, options);
  if (!planes) return planes.error();
  const std::string scene_id = scene->id();
  const bool is_frame = targetOf(options).kind == TargetKind::Frame;
  FrameMaker maker{*model,
                   *std::move(scene),
                   *trajectory,
                   *pose,
                   *schedule,
                   options.settings,
                   tracedPlanes(*planes, options),
                   is_frame ? model->model() : nameOfCamera(options)};
  if (isIn(PlaneKind::Color, *planes)) {
    auto visible = loadVisibleScene(options.scene);
    if (!visible) return visible.error();
    maker.addColor(*std::move(visible));
  }
  return Job{std::move(maker), *std::move(trajectory), scene_id, *planes};
}

}  // namespace

Target targetOf(const RenderOptions& options) {
  return targetOf(options.output.file, options.frames > 0 || !options.trajectory.empty());
}

Result<FrameMaker> makerOf(const RenderOptions& options) {
  auto job = jobOf(options);
  if (!job) return job.error();
  return std::move(job->maker);
}

Result<Exit> renderCampaign(const RenderOptions& options) {
  auto job = jobOf(options);
  if (!job) return job.error();
  const Target target = targetOf(options);
  if (auto made = makeFolder(target); !made) return made.error();
  const std::vector<Input> inputs =
      inputsOf(options, job->maker, job->scene_id, job->trajectory, job->planes);
  std::vector<std::pair<std::string, std::string>> about{{"model", job->maker.model().model()}};
  for (const Input& input : inputs) about.emplace_back("input_" + input.name, input.value);
  const auto sink =
      sinkOf(target, options.formats, job->planes, options.output.how, job->maker.schedule().frames, about);
  const auto report = runCampaign(job->maker, *sink, inputs, filesOf(target, options.overwrite));
  if (!report) return report.error();
  const std::uint64_t all = report->rendered + report->there_already;
  fmt::print(
      "{}: {}{}; {}\n", options.output.file, counted(all, "frame"),
      report->there_already > 0 ? fmt::format(", {} of them there already", report->there_already) : "",
      sink->note());
  return Exit::Ok;
}

}  // namespace toftwin::cli
