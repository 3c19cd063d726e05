// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "calib/compare/poses.h"
#include "calib/file/calibration_file.h"
#include "calib/intrinsics/board_pose.h"
#include "calib/intrinsics/brightness.h"
#include "calib/intrinsics/hand_eye.h"
#include "protocol/settings/describe.h"
#include "protocol/types/counted.h"
#include "tools/cli/board_options.h"
#include "tools/cli/command.h"
#include "tools/cli/export/atomic_file.h"

namespace toftwin::cli {
namespace locate_command {

using namespace intrinsics;

struct Options {
  std::vector<std::string> images;
  BoardOptions board;
  std::string calibration, rig, output;
  int every = 1;
};

struct Located {
  std::string name;
  BoardSighting board;
};

/// All images in which the board is; the others are said and left out, unless a rig's poses need each.
Result<std::vector<Located>> locateAll(const Options& options, const intrinsics::Target& target,
                                       const CameraInfo& camera) {
  std::vector<Located> all;
  const auto take = [&](NamedImage image) -> Result<> {
    auto found = locateBoard(image.brightness, target, camera);
    if (found) {
      all.push_back({image.name, *found});
      return {};
    }
    if (!options.rig.empty())
      return Error{found.error().code, fmt::format("{}: {}", image.name, found.error().message)};
    fmt::print(stderr, "  left out {}: {}\n", image.name, found.error().message);
    return {};
  };
  for (const std::string& name : options.images) {
    if (isRecording(name)) {
      if (auto read = readRecording(name, options.every, take); !read) return read.error();
      continue;
    }
    auto brightness = loadBrightness(name);
    if (!brightness) return brightness.error();
    if (auto taken = take({name, *std::move(brightness)}); !taken) return taken.error();
  }
  if (all.empty()) return Error{Error::Code::NotFound, "the board was found in none of the images"};
  return all;
}

/// The pose file's entry, with what is known of it as a comment.
template <class In>
std::string entryOf(const Located& located, const Transform<In, Camera>& pose) {
  const auto& p = pose.translation_m;
  return fmt::format(
      "\n[[pose]]\nname = {}\n# {} corners, {:.3f} px RMS; 95 % of the board in the camera: {}\nposition_m = "
      "[{:.6f}, {:.6f}, "
      "{:.6f}]\nrotation_wxyz = [{:.8f}]\n",
      settings::toToml(located.name), located.board.corners, located.board.rms_px,
      uncertaintyInWords(located.board.camera_from_board.covariance, located.board.camera_from_board.degrees),
      p.x, p.y, p.z, fmt::join(pose.rotation_wxyz, ", "));
}

Result<HandEye> handEyeFrom(const Options& options, const std::vector<Located>& all,
                            std::vector<Transform<World, Rig>>& stands) {
  const auto poses = compare::loadPoses(options.rig);
  if (!poses) return poses.error();
  if (poses->size() != all.size()) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("{} has {} of the rig, but the board was found in {}: one for each, in their order", options.rig,
                    counted(poses->size(), "pose"), counted(all.size(), "image"))};
  }
  std::vector<HandEyeView> views;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto pose = (*poses)[i].world_from_camera();
    stands.push_back({pose.rotation_wxyz, pose.translation_m});
    views.push_back({stands.back(), all[i].board.camera_from_board});
  }
  return handEye(views);
}

std::string textOf(const HandEye& known) {
  const auto& p = known.rig_from_camera.pose.translation_m;
  const auto& b = known.world_from_board.pose.translation_m;
  return fmt::format(
      "the camera on the rig: at {:.5f}, {:.5f}, {:.5f} m, turned by {:.6f} (w, x, y, z); 95 %: {}\n"
      "the board in the world: at {:.5f}, {:.5f}, {:.5f} m, turned by {:.6f}; 95 %: {}\n"
      "misfit {:.2f} (1: rig and images contradict each other no more than the images' corners say)\n",
      p.x, p.y, p.z, fmt::join(known.rig_from_camera.pose.rotation_wxyz, ", "),
      uncertaintyInWords(known.rig_from_camera.covariance, known.rig_from_camera.degrees), b.x, b.y, b.z,
      fmt::join(known.world_from_board.pose.rotation_wxyz, ", "),
      uncertaintyInWords(known.world_from_board.covariance, known.world_from_board.degrees), known.misfit);
}

Result<Exit> act(const Options& options) {
  const auto target = intrinsics::targetOf(options.board.words());
  if (!target) return target.error();
  if (const auto told = intrinsics::tellsItsPose(*target); !told) return told.error();
  const auto lens = calibration::load(options.calibration);
  if (!lens) return lens.error();
  const auto all = locateAll(options, *target, calibration::cameraOf(lens->lens));
  if (!all) return all.error();
  std::string file =
      options.rig.empty()
          ? "# Where a camera stood, by toftwin locate. The world is the board: its origin is the first "
            "corner, x runs along\n# its columns, y along its rows, z away from the camera.\n"
          : "# Where a camera stood, by toftwin locate: the rig's poses and the camera's place on it.\n";
  if (options.rig.empty()) {
    for (const Located& one : *all) file += entryOf(one, one.board.camera_from_board.pose.inverse());
  } else {
    std::vector<Transform<World, Rig>> stands;
    const auto known = handEyeFrom(options, *all, stands);
    if (!known) return known.error();
    fmt::print("{}", textOf(*known));
    constexpr double kContradicts = 3.0;  // a rig that is not as exact as the corners; ten and more: something is wrong
    if (known->misfit > kContradicts) {
      fmt::print(stderr,
                 "warning: rig and images contradict each other by {:.3g} times what the corners let expect, most in "
                 "{}: are the poses of {} in the order of the images, and did the board stand still?\n",
                 known->misfit, (*all)[known->worst_view].name, options.rig);
    }
    for (std::size_t i = 0; i < all->size(); ++i)
      file += entryOf((*all)[i], worldFromCamera(*known, stands[i]));
  }
  if (auto written = writeWhole(options.output, file); !written) return written.error();
  fmt::print("{}: {}\n", options.output, counted(all->size(), "pose"));
  return Exit::Ok;
}

Run add(Arguments& args) {
  const auto options = std::make_shared<Options>();
  args.option("IMAGES", options->images,
              "grey images or recordings (FILE.mcap, FILE.mcap#SOURCE), whose amplitude is taken")
      .required();
  options->board.add(args);
  args.option("--calibration", options->calibration, "the lens: a file of toftwin calibrate").required();
  args.option("--rig", options->rig,
              "pose file with where the rig stood in each image: gives the camera's place on the rig and "
              "poses in the rig's world");
  args.option("--every", options->every, "of a recording, every n-th frame")
      .within(1, 1'000'000)
      .showsDefault();
  args.option("-o,--output", options->output, "pose file").required();
  args.check([options] { return options->board.check(); });
  return [options] { return act(*options); };
}

}  // namespace locate_command

Command locateCommand() {
  using namespace locate_command;
  return {
      "locate", "where a camera stood, from a board that it saw: a pose file",
      "  toftwin locate shots/*.png --board 8x5 --square 32 --calibration lens.toml -o poses.toml\n"
      "  toftwin locate shots/*.png --board 8x5 --square 32 --calibration lens.toml --rig rig.toml -o "
      "poses.toml\n"
      "  toftwin locate walk.mcap --tags 5x4 --square 75 --marker 60 --calibration lens.toml -o poses.toml\n",
      add};
}

}  // namespace toftwin::cli
