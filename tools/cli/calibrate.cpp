// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/calibrate.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "calib/intrinsics/overlay.h"
#include "calib/intrinsics/verdict.h"
#include "protocol/types/counted.h"
#include "tools/cli/board_options.h"
#include "tools/cli/command.h"
#include "tools/cli/export/atomic_file.h"
#include "tools/cli/options.h"
#include "tools/cli/terminal.h"

namespace toftwin::cli {
namespace calibrate_command {

using namespace intrinsics;
namespace fs = std::filesystem;

constexpr const char* kExamples =
    "  toftwin calibrate shots/*.png --board 8x5 --square 32 -o camera.toml\n"
    "  toftwin calibrate walk.mcap --board 8x5 --square 32 -o camera.toml    frames of a recording\n"
    "  toftwin calibrate --source kinect --board 8x5 --square 32 -o camera.toml    live; it says what "
    "is missing\n"
    "  toftwin calibrate shots/*.png --tags 5x4 --square 75 --marker 60 -o camera.toml    AprilTags\n"
    "  toftwin calibrate shots/*.png --board 8x5 --square 32 -o camera.toml --overlay seen    pictures of "
    "what was found\n"
    "  toftwin calibrate --show 3f2a...    a calibration by the id that frames name\n";

struct Options {
  DaemonOptions daemon;
  LiveOptions live;
  std::vector<std::string> images;
  BoardOptions board;
  std::string model = "auto";
  std::string output;
  std::string overlay;
  std::string store;
  std::string shown_id;
  int every = 1;
  bool no_store = false;
  bool is_flat = false;
};

std::optional<LensModel> modelFrom(const std::string& name) {
  for (const LensModel model : kLensModels) {
    if (nameOf(model) == name) return model;
  }
  return std::nullopt;
}

std::string now() {
  const std::time_t seconds = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", utc);
}

fs::path storeOf(const Options& options) {
  return options.store.empty() ? calibration::storeFolder() : fs::path{options.store};
}

/// Pictures for --overlay are made when the lens is known, from images that are kept until then.
using Kept = std::map<std::string, Image<float>>;

Result<> collectFiles(const Options& options, Collector& collector, Kept& kept) {
  Progress progress{"images", options.images.size()};
  std::uint64_t done = 0;
  const auto take = [&](NamedImage image) -> Result<> {
    if (interrupted()) return Error{Error::Code::Stopped, "stopped"};
    if (auto added = collector.add(image); !added) return added.error();
    if (!options.overlay.empty()) kept.insert_or_assign(image.name, std::move(image.brightness));
    return {};
  };
  const auto takeIfNew = [&](NamedImage image) -> Result<> {
    if (interrupted()) return Error{Error::Code::Stopped, "stopped"};
    const ImageSize size{image.brightness.width(), image.brightness.height()};
    Sighting sighting = findBoard(image.brightness, collector.target(), collector.options());
    sighting.name = image.name;
    if (sighting.isUsed() && collector.isLikeAnother(sighting)) {
      sighting.rejection = Rejection::LikeAnother;
      sighting.detail = "the board hardly moved";
    }
    if (!options.overlay.empty()) kept.insert_or_assign(image.name, std::move(image.brightness));
    return collector.add(std::move(sighting), size);
  };
  for (const std::string& name : options.images) {
    if (isRecording(name)) {
      if (auto read = readRecording(name, options.every, takeIfNew); !read) return read;
    } else {
      auto brightness = loadBrightness(name);
      if (!brightness) return brightness.error();
      if (auto taken = take({name, *std::move(brightness)}); !taken) return taken;
    }
    progress.show(++done);
  }
  return {};
}

Result<> writeOverlays(const std::string& folder, const Calibrated& calibrated, const Kept& kept) {
  std::error_code fault;
  fs::create_directories(folder, fault);
  if (fault) return cannotWrite(folder, fault.value());
  for (std::size_t i = 0; i < calibrated.sightings.size(); ++i) {
    const std::string& name = calibrated.sightings[i].name;
    const auto image = kept.find(name);
    if (image == kept.end()) continue;
    std::string stem = fs::path{name}.filename().string();
    std::ranges::replace(stem, ' ', '-');
    const auto png = overlayPng(calibrated, i, image->second);
    const auto written = writeWhole(fs::path{folder} / fmt::format("{:03}-{}.png", i, stem), png);
    if (!written) return written;
  }
  return {};
}

Result<> storeFiles(const Options& options, const Calibrated& calibrated) {
  const auto file = fileOf(calibrated, now());
  const std::string text = calibration::toText(file);
  const std::string id = calibration::cameraOf(file.lens).calibration_id;
  if (auto written = writeWhole(options.output, text); !written) return written;
  fmt::print("{}: calibration {}\n", options.output, id);
  const fs::path store = storeOf(options);
  if (options.no_store || store.empty()) return {};
  std::error_code fault;
  fs::create_directories(store, fault);
  if (fault) return cannotWrite(store, fault.value());
  const fs::path place = store / (id + ".toml");
  if (auto written = writeWhole(place, text); !written) return written;
  fmt::print("kept as {}\n", place.string());
  return {};
}

Result<Exit> show(const Options& options) {
  const fs::path place = storeOf(options) / (options.shown_id + ".toml");
  std::ifstream in{place};
  if (!in) {
    return Error{Error::Code::NotFound,
                 fmt::format("{}: there is no such calibration; --store names another folder", place.string())};
  }
  std::ostringstream text;
  text << in.rdbuf();
  fmt::print("{}", text.str());
  return Exit::Ok;
}

/// In some images a part of a larger board looks like one of the counts that were told: where most say
/// otherwise, they are of the same board.
Result<> checkCounts(const std::vector<Sighting>& sightings, const intrinsics::Target& target) {
  const auto more = std::ranges::count_if(sightings, &Sighting::has_more),
             used = std::ranges::count_if(sightings, &Sighting::isUsed);
  if (more == 0 || more < used) return {};
  return Error{
      Error::Code::InvalidArgument,
      fmt::format("{} of {} images show a board with more than {} x {} inner corners: count where four "
                  "squares meet, along each side, and say so with --board",
                  more, sightings.size(), target.columns, target.rows)};
}

Result<Exit> run(const Options& options) {
  if (!options.shown_id.empty()) return show(options);
  const auto target = intrinsics::targetOf(options.board.words());
  if (!target) return target.error();
  catchInterrupts();
  Collector collector{*target};
  Kept kept;
  const OnView keep = [&](const NamedImage& image) {
    if (!options.overlay.empty()) kept.insert_or_assign(image.name, image.brightness);
  };
  const auto collected = options.live.source.empty()
                             ? collectFiles(options, collector, kept)
                             : collectLive(options.daemon, options.live, collector, keep);
  if (!collected) return collected.error();

  Calibrated calibrated{.target = *target, .size = collector.size(), .sightings = collector.sightings()};
  calibrated.camera = options.live.source.empty() ? counted(calibrated.sightings.size(), "image")
                                                  : options.live.source;
  if (auto counted = checkCounts(calibrated.sightings, *target); !counted) return counted.error();
  EstimateOptions how{.model = modelFrom(options.model)};
  calibrated.was_model_asked = how.model.has_value();
  if (options.is_flat) how.degree = 0;
  auto result = estimate(*target, calibrated.sightings, calibrated.size, how);
  if (!result) {
    for (const Sighting& sighting : calibrated.sightings) {
      if (sighting.isUsed()) continue;
      fmt::print(stderr, "  rejected {}: {} ({})\n", sighting.name, nameOf(sighting.rejection), sighting.detail);
    }
    return result.error();
  }
  calibrated.estimate = *std::move(result);
  fmt::print("{}", describe(calibrated));
  if (!options.overlay.empty()) {
    if (auto written = writeOverlays(options.overlay, calibrated, kept); !written) return written.error();
  }
  if (auto stored = storeFiles(options, calibrated); !stored) return stored.error();
  return Exit::Ok;
}

Error usage(std::string what) { return {Error::Code::InvalidArgument, std::move(what)}; }

Result<> check(const Options& options) {
  if (!options.shown_id.empty()) {
    if (options.shown_id.find_first_not_of("0123456789abcdef") == std::string::npos) return {};
    return usage(fmt::format("--show {}: an id is 32 hex digits", options.shown_id));
  }
  if (options.images.empty() == options.live.source.empty()) {
    return usage("give images or recordings, or else --source with the name of a camera");
  }
  if (auto said = options.board.check(); !said) return said;
  if (options.output.empty()) return usage("give -o, the file that the calibration is written to");
  if (options.model == nameOf(LensModel::Rational)) {
    return usage("a camera file holds five terms of distortion; rational is only compared");
  }
  const auto target = intrinsics::targetOf(options.board.words());
  return target ? Result<>{} : target.error();
}

Run add(Arguments& args) {
  auto options = std::make_shared<Options>();
  args.option("IMAGES", options->images,
              "grey images (PNG, 8 or 16 bits, …) or recordings (FILE.mcap, FILE.mcap#SOURCE), "
              "whose amplitude is "
              "taken; all of one size");
  options->board.add(args);
  args.option("-o,--output", options->output, "the calibration, TOML");
  std::vector<std::string> models{"auto"};
  for (const LensModel model : kLensModels) models.emplace_back(nameOf(model));
  args.option("--model", options->model,
              "terms of distortion; auto: as many as help on held-out views")
      .oneOf(models)
      .showsDefault();
  args.flag("--flat", options->is_flat, "take the board as flat, even if views say it is bent");
  args.option("--overlay", options->overlay,
              "folder for a picture of each view with what was found in it");
  args.option("--every", options->every, "of a recording, every n-th frame")
      .within(1, 1'000'000)
      .showsDefault();
  args.option("--source", options->live.source, "name of a camera, to take views live");
  args.option("--views", options->live.most_views, "live: no more than so many")
      .within(3, 1000)
      .showsDefault();
  args.option("--store", options->store,
              "folder that keeps calibrations by id; default: $XDG_DATA_HOME/toftwin/calibrations");
  args.flag("--no-store", options->no_store, "do not keep it there");
  args.option("--show", options->shown_id, "print the kept calibration with this id");
  options->daemon.add(args);
  args.check([options] { return check(*options); });
  return [options] { return run(*options); };
}

}  // namespace calibrate_command

Command calibrateCommand() {
  using namespace calibrate_command;
  return {"calibrate", "a camera's lens from images of a checkerboard, ChArUco board or AprilTags", kExamples,
          add};
}

}  // namespace toftwin::cli
