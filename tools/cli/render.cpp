// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "sim/sensor/frame_assembly.h"
#include "tools/cli/command.h"
#include "tools/cli/options.h"
#include "tools/cli/pose.h"
#include "tools/cli/render_campaign.h"
#include "tools/cli/render_images.h"
#include "tools/cli/render_transient.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace {

using drivers::simulator::Keys;

const std::map<std::string, Format>& folderFormats() {
  static const std::map<std::string, Format> kFormats{
      {"png", Format::Png}, {"npy", Format::Npy}, {"ply", Format::Ply}, {"csv", Format::Csv}};
  return kFormats;
}

std::string presetHelp() {
  return fmt::format("a preset ({}), or a camera file (.toml)",
                     fmt::join(sim::SensorModel::presetNames(), ", "));
}

Result<> checkOptions(RenderOptions& options) {
  const Target target = targetOf(options);
  const bool is_folder = target.kind == TargetKind::Folder;
  if (!options.format_names.empty() && !is_folder) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("--format has a meaning for a folder only (-o frames/), not for -o {}, whose extension "
                    "says it",
                    options.output.file)};
  }
  options.formats.clear();
  for (const std::string& name : options.format_names) {
    const auto found = folderFormats().find(name);
    if (found == folderFormats().end()) {
      return Error{Error::Code::InvalidArgument,
                   fmt::format("--format {}: in a folder there can be png, npy, ply and csv", name)};
    }
    options.formats.push_back(found->second);
  }
  if (is_folder && options.formats.empty()) options.formats = {Format::Npy};
  if (options.images && target.kind != TargetKind::Frame) {
    return Error{
        Error::Code::InvalidArgument,
        "--images has a meaning for one frame only; of several, -p range,amplitude,color writes the colour "
        "image of each"};
  }
  if (options.overwrite && target.kind == TargetKind::Frame) {
    return Error{Error::Code::InvalidArgument,
                 "--overwrite has a meaning for campaigns only: one frame always "
                 "replaces what is there"};
  }
  const bool is_for_frames = target.kind != TargetKind::Frame || options.images ||
                             !options.output.plane_names.empty() || options.settings.keys.light_noise > 0_mm;
  if (options.transient && (is_for_frames || !options.output.file.ends_with(".npy"))) {
    return Error{
        Error::Code::InvalidArgument,
        "--transient writes one histogram into a file FILE.npy: leave out --frames, --trajectory, --images, "
        "--plane and --light-noise-mm"};
  }
  const sim::TransientBins plain = RenderOptions{}.bins;
  const bool has_bins = options.bins.first.in(metre) != plain.first.in(metre) ||
                        options.bins.width.in(metre) != plain.width.in(metre) ||
                        options.bins.count != plain.count;
  if (has_bins && !options.transient) {
    return Error{Error::Code::InvalidArgument,
                 "--first-m, --bin-mm and --bins have a meaning with --transient only, which is not there"};
  }
  const bool stands = options.trajectory.empty();
  if (!stands && options.pose.isGiven())
    return Error{Error::Code::InvalidArgument,
                 "--trajectory says where the camera is; leave the options of a pose out"};
  if (is_folder) return options.output.check(options.formats);
  if (target.kind == TargetKind::Recording) return options.output.check(std::vector<Format>{});
  return options.output.check();
}

/// One file of one frame.
Result<Exit> renderOne(const RenderOptions& options) {
  auto maker = makerOf(options);
  if (!maker) return maker.error();
  Progress progress{"rows", static_cast<std::uint64_t>(maker->model().camera().height)};
  const auto frame = maker->make(0, [&](double share) {
    progress.show(static_cast<std::uint64_t>(share * maker->model().camera().height));
    return !interrupted();
  });
  if (!frame) return Error{frame.error().code, frame.error().message + "; nothing was written"};
  const auto note = exportFrame(*frame, options.output.file, options.output.how);
  if (!note) return note.error();
  fmt::print("{}: {}\n", options.output.file, *note);
  if (!options.images) return Exit::Ok;
  return renderImages(*frame, maker->model(), options.scene, options.output.file, options.settings.keys);
}

Result<Exit> run(const RenderOptions& options) {
  catchInterrupts();
  if (options.transient) return renderTransient(options);
  return targetOf(options).kind == TargetKind::Frame ? renderOne(options) : renderCampaign(options);
}

std::vector<std::string> samplerNames() {
  std::vector<std::string> names;
  for (const auto& [name, sampler] : drivers::simulator::samplers()) names.push_back(name);
  return names;
}

void addSettings(Arguments& args, RenderSettings& settings) {
  args.option("--samples", settings.keys.samples_per_pixel, "light paths per pixel")
      .within(1, 65'536)
      .showsDefault();
  args.given<std::string>(
          "--sampler",
          [&settings](const std::string& name) {
            settings.keys.sampler = drivers::simulator::samplers().at(name);
          },
          "how light paths are drawn: shared by tiles of pixels (as if not given), even in each "
          "pixel, or plain")
      .oneOf(samplerNames());
  args.given<double>(
          "--light-noise-mm",
          [&settings](double mm) { settings.keys.light_noise = mm * millimetre; },
          "only as many paths as leave this noise of the light in the range at the highest "
          "frequency, at most "
          "--samples; 0: always that many")
      .within(0.0, 1000.0);
  args.option("--surfaces", settings.keys.max_surfaces,
              "surfaces that a path may meet; 1: direct light only")
      .within(1, 64)
      .showsDefault();
  args.option("--pixel-extent", settings.keys.pixel_extent,
              "side of a pixel's footprint in pixels; 0: its central ray, no flying pixels")
      .within(0.0, 4.0)
      .showsDefault();
  args.option("--seed", settings.keys.seed, "of the light paths and the noise").showsDefault();
  args.option("--frame", settings.first_noise,
              "number of the (first) frame: another one has other noise")
      .showsDefault();
  args.option("--since-power-on", settings.since_power_on_s,
              "seconds that the camera has been on at device time 0")
      .notNegative()
      .showsDefault();
  args.option("--ambient-klx", settings.ambient_klx, "ambient light at the scene, in kilolux")
      .within(0.0, 200.0)
      .showsDefault();
  args.option("--room-temperature-c", settings.room_temperature_c, "in degrees Celsius")
      .within(-40.0, 100.0)
      .showsDefault();
  args.flag("--freeze", settings.freeze,
            "within a frame nothing moves: all raw exposures get the light of the middle one. As "
            "many times "
            "faster as there are raw exposures");
}

void addTransient(Arguments& args, RenderOptions& options) {
  args.flag("--transient", options.transient,
            "no frame, but the light of each pixel by the length of its way, from the emitter to the lens: "
            "an array "
            "bins x rows x columns (.npy), and FILE.npy.toml that says where the bins lie");
  args.given<double>(
          "--first-m", [&options](double m) { options.bins.first = m * metre; },
          "with --transient: where the first bin begins, in metres of way, twice the range (default: 0)")
      .within(0.0, 1e6);
  args.given<double>(
          "--bin-mm", [&options](double mm) { options.bins.width = mm * millimetre; },
          "with --transient: how wide a bin is (default: 20)")
      .within(1e-3, 1e6);
  args.option("--bins", options.bins.count, "with --transient: how many there are")
      .within(1, 100'000)
      .showsDefault();
}

void addCampaign(Arguments& args, RenderOptions& options) {
  args.option("--trajectory", options.trajectory,
              "poses of the camera (.toml, or a text table): between times it moves, without times each "
              "pose gives a frame");
  args.option("-n,--frames,--count", options.frames,
              "how many; default: from the first pose of the trajectory to the last, or 1")
      .within(std::uint64_t{1}, std::uint64_t{100'000'000});
  args.option("--frame-interval-ms", options.frame_interval_ms,
              "from frame to frame; default: the camera's own")
      .within(1e-3, 1e9);
  args.option("--format", options.format_names,
              "of the files in a folder: png, npy, ply, csv, or several (--format png,ply); "
              "default: npy")
      .separatedBy(',')
      .oneAtATime();
  args.flag("--overwrite", options.overwrite,
            "replace another campaign's frames that are there already");
}

}  // namespace

Command renderCommand() {
  return {
      "render", "frames of the simulator, without a daemon; defaults as of a simulated source",
      "  toftwin render kinect_v2 -o range.png\n"
      "  toftwin render my_camera.toml --scene room.toml -o cloud.ply --position 0,0,-1 --look-at "
      "0,0,2\n"
      "  toftwin render kinect_v2 --scene room.toml -o truth.npy --plane truth_range\n"
      "  toftwin render kinect_v2 --samples 64 -o raw.npy --plane samples\n"
      "  toftwin render kinect_v2 --scene desk.toml --samples 64 --images -o desk.png\n"
      "  toftwin render kinect_v2 --scene desk.toml --samples 64 --transient --first-m 1 -o desk.npy\n"
      "  toftwin render o3d303 --scene room.toml --trajectory walk.csv -o walk/ --format png,ply\n"
      "  toftwin render o3d303 --scene room.toml --trajectory walk.csv -o walk.h5      resumes "
      "when it "
      "was killed\n"
      "  toftwin render o3d303 --scene room.toml --frames 1000 -o noise.mcap\n",
      [](Arguments& args) -> Run {
        const auto options = std::make_shared<RenderOptions>();
        args.option("CAMERA,--camera", options->camera, presetHelp()).required();
        args.option("--scene", options->scene, "scene file (.toml); default: a box before a wall");
        options->output.add(args, true);
        args.declared("--output")
            .describe(
                "file of one frame (.png .ply .npy .csv .h5), of all frames (.h5 .mcap), or a "
                "folder "
                "(frames/) for a file of each; several frames in .png .ply .npy .csv are numbered");
        options->pose.add(args);
        addCampaign(args, *options);
        addSettings(args, options->settings);
        addTransient(args, *options);
        args.flag("--images", options->images,
                  "also FILE-infrared.png and FILE-depth.png as pictures to look at, and, for a "
                  "camera with a "
                  "colour lens, FILE-color.png from its place, FILE-color-in-depth.png and "
                  "FILE-depth-in-color.png");
        args.check([options] { return checkOptions(*options); });
        return [options] { return run(*options); };
      }};
}

}  // namespace toftwin::cli
