// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/fields.h>
#include <toftwin/result.h>
#include <toftwin/units.h>

#include "calib/compare/poses.h"
#include "calib/plan/pose_source.h"

/// What two cameras are to be captured at, in which order, and whether that order lets effects be told apart.
namespace toftwin::plan {

/// What a block is for. It says what the block must have and which effects can be told with it.
enum class Kind {
  WarmUp,
  Distance,
  Exposure,
  Ambient,
  Checkerboard,
  BrightDark,
  Foreground,
  Scatter,
  Corner,
  Tilt,
  Moving,
  Dark,
  NearField,
  Repeats,
  Locked
};
/// As in a plan file: "warm_up".
std::string_view nameOf(Kind kind);

/// In which order the captures of a block are taken.
enum class Order { Random, AsWritten };

/// A part of a plan: conditions, which are its poses × exposures × ambients, taken `repeats` times.
struct BlockSpec {
  std::string name{};
  Kind kind = Kind::Distance;
  std::string setup{};
  std::vector<compare::PoseSpec> poses{};
  std::vector<double> distance_m{};
  std::vector<double> angle_deg{};
  std::vector<double> target_m{};
  std::vector<double> target_normal{};
  std::vector<double> target_size_m{};
  PoseFrom pose_from = PoseFrom::Command;
  std::vector<Duration> exposures{};
  std::vector<Illuminance> ambients{};
  Order order = Order::Random;
  int repeats = 1;
  int frames = 0;
  Duration interval{};
  int locked = 0;
  double corner_deg = 0.0;
  double speed_m_per_s = 0.0;
  int captures = 0;
  std::vector<std::string> of{};

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "how the run and the report call it; each block its own");
    v.choice("kind", kind,
             {{"warm_up", Kind::WarmUp},
              {"distance", Kind::Distance},
              {"exposure", Kind::Exposure},
              {"ambient", Kind::Ambient},
              {"checkerboard", Kind::Checkerboard},
              {"bright_dark", Kind::BrightDark},
              {"foreground", Kind::Foreground},
              {"scatter", Kind::Scatter},
              {"corner", Kind::Corner},
              {"tilt", Kind::Tilt},
              {"moving", Kind::Moving},
              {"dark", Kind::Dark},
              {"near_field", Kind::NearField},
              {"repeats", Kind::Repeats},
              {"locked", Kind::Locked}},
             "what it is for");
    v.text("setup", setup, "what a person must prepare before it; shown, and to be confirmed");
    v.group("pose", poses, "where the cameras stand; or distance_m and angle_deg say it");
    v.numbers("distance_m", distance_m, {0.01, 1000.0},
              "instead of poses: distances from the target, the camera looking at it");
    v.numbers("angle_deg", angle_deg, {-89.0, 89.0},
              "with distance_m: angles from the target's normal, about the vertical; none: 0");
    v.numbers("target_m", target_m, {-1e6, 1e6}, "three numbers: another target than the plan's");
    v.numbers("target_normal", target_normal, {-1e6, 1e6}, "three numbers: the same for its normal");
    v.numbers("target_size_m", target_size_m, {0.01, 1e4}, "two numbers: another size than the plan's");
    v.choice("pose_from", pose_from,
             {{"command", PoseFrom::Command},
              {"board", PoseFrom::Board},
              {"planes", PoseFrom::Planes},
              {"board_and_rig", PoseFrom::BoardAndRig}},
             "what says where the cameras stood: who put them there; the [board] or the [[plane]]s that they "
             "see; the rig, with the camera's place on it from the captures that saw the board");
    v.quantities("exposure", exposures, microsecond, {0.1, 1e7},
                 "exposure times to go through; none: the plan's");
    v.quantities("ambient", ambients, kilolux, {0.0, 200.0}, "ambient light to go through; none: the plan's");
    v.choice("order", order, {{"random", Order::Random}, {"as_written", Order::AsWritten}},
             "of its captures: drawn by the plan's seed, each repeat anew; or as they stand there");
    v.number("repeats", repeats, {1, 10'000}, "how often each condition is captured");
    v.number("frames", frames, {0, 100'000}, "of each camera for each capture; 0: the plan's");
    v.quantity("interval", interval, second, {0.0, 86'400.0},
               "from the begin of one capture to that of the next, at least");
    v.number(
        "locked", locked, {0, 10'000},
        "so many of its conditions, drawn by the seed, are held back for judging, with all their repeats");
    v.number("corner_deg", corner_deg, {0.0, 180.0}, "corner: between its two walls");
    v.number("speed_m_per_s", speed_m_per_s, {0.0, 100.0}, "moving: of the plate");
    v.number("captures", captures, {0, 10'000},
             "repeats: how many earlier conditions are captured again, drawn by the seed");
    v.texts("of", of,
            "repeats: names of the blocks they are drawn from; none: every earlier one without setup");
  }
};

/// A plan file.
struct Plan {
  std::string name{};
  std::uint64_t seed = 1;
  int frames = 10;
  Duration exposure{};
  Illuminance ambient{};
  std::array<double, 3> target_m{0.0, 0.0, 2.0};
  std::array<double, 3> target_normal{0.0, 0.0, -1.0};
  std::vector<double> target_size_m{};
  Duration pose_time = 10_s;
  Duration setup_time = 120_s;
  Duration warm_up_time = 900_s;
  BoardSpec board{};
  std::vector<PlaneSpec> planes{};
  std::vector<BlockSpec> blocks{};

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "of the plan");
    v.number("seed", seed, {0, 9'007'199'254'740'992.0},
             "of every order and draw; the same seed gives the same plan");
    v.number("frames", frames, {2, 100'000}, "of each camera for each capture");
    v.quantity("exposure", exposure, microsecond, {0.0, 1e7},
               "where a block says none; 0: the camera's own, if no block changes it");
    v.quantity("ambient", ambient, kilolux, {0.0, 200.0}, "where a block says none");
    v.numbers("target_m", target_m, {-1e6, 1e6}, "the point in the world that distances are measured to");
    v.numbers("target_normal", target_normal, {-1e6, 1e6},
              "of the target, towards the cameras; any length but 0");
    v.numbers("target_size_m", target_size_m, {0.01, 1e4},
              "width and height of the wall around the target's point; what is seen beside it is not judged "
              "against "
              "it. Empty: it has no end");
    v.quantity("pose_time", pose_time, second, {0.0, 86'400.0},
               "what it takes from one pose to the next, to tell how long the plan takes");
    v.quantity("setup_time", setup_time, second, {0.0, 86'400.0},
               "what a person takes for the setup of a block");
    v.quantity("warm_up_time", warm_up_time, second, {1.0, 1e6},
               "time constant of the camera's warm-up, for the check of what goes with it");
    v.group("board", board, "for blocks whose poses are taken from it");
    v.group("plane", planes, "for blocks whose poses are taken from them");
    v.group("block", blocks, "one after the other");
  }
};

/// Errors name file, line and key, all at once. `skip`: names of blocks to leave out; the others stay
/// exactly as they are.
Result<Plan> loadPlan(const std::filesystem::path& file, const std::vector<std::string>& skip = {});
Result<Plan> parsePlan(std::string_view toml, const std::filesystem::path& name,
                       const std::vector<std::string>& skip = {});

/// The keys as Markdown, for docs/plan.md.
std::string documentPlan();

}  // namespace toftwin::plan
