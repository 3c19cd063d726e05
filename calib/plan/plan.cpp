// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/plan.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "protocol/settings/describe.h"
#include "protocol/settings/settings.h"

namespace toftwin::plan {
namespace {

using settings::Table;

struct KindName {
  Kind kind;
  std::string_view name;
};
constexpr std::array kKinds{KindName{Kind::WarmUp, "warm_up"},
                            KindName{Kind::Distance, "distance"},
                            KindName{Kind::Exposure, "exposure"},
                            KindName{Kind::Ambient, "ambient"},
                            KindName{Kind::Checkerboard, "checkerboard"},
                            KindName{Kind::BrightDark, "bright_dark"},
                            KindName{Kind::Foreground, "foreground"},
                            KindName{Kind::Scatter, "scatter"},
                            KindName{Kind::Corner, "corner"},
                            KindName{Kind::Tilt, "tilt"},
                            KindName{Kind::Moving, "moving"},
                            KindName{Kind::Dark, "dark"},
                            KindName{Kind::NearField, "near_field"},
                            KindName{Kind::Repeats, "repeats"},
                            KindName{Kind::Locked, "locked"}};

std::size_t different(std::vector<double> values) {
  std::ranges::sort(values);
  return static_cast<std::size_t>(std::ranges::distance(values.begin(), std::ranges::unique(values).begin()));
}

template <class Q, class U>
std::size_t different(const std::vector<Q>& quantities, U unit) {
  std::vector<double> plain;
  for (const Q& one : quantities) plain.push_back(one.in(unit));
  return different(std::move(plain));
}

std::size_t conditionsOf(const BlockSpec& block) {
  const std::size_t poses = block.poses.empty()
                                ? block.distance_m.size() * std::max<std::size_t>(1, block.angle_deg.size())
                                : block.poses.size();
  return std::max<std::size_t>(1, poses) * std::max<std::size_t>(1, block.exposures.size()) *
         std::max<std::size_t>(1, block.ambients.size());
}

/// What is wrong with where the cameras stand.
void checkPlaces(const BlockSpec& block, Table& table) {
  const bool has_poses = !block.poses.empty(), has_distances = !block.distance_m.empty();
  const bool is_repeats = block.kind == Kind::Repeats;
  if (has_poses && has_distances)
    table.complain("distance_m", "stands beside [[block.pose]]: say it one way");
  if (!has_distances && !block.angle_deg.empty()) table.complain("angle_deg", "needs distance_m");
  if (is_repeats && (has_poses || has_distances)) {
    table.complain(has_poses ? "pose" : "distance_m",
                   "has no meaning for repeats: they are at earlier poses");
  }
  if (!is_repeats && block.kind != Kind::Dark && !has_poses && !has_distances) {
    table.complain("", "is a block without poses: write [[block.pose]] or distance_m");
  }
  for (const auto& [key, values] :
       {std::pair{"target_m", &block.target_m}, {"target_normal", &block.target_normal}}) {
    if (!values->empty() && values->size() != 3) table.complain(key, "must be three numbers");
  }
  if (!block.target_size_m.empty() && block.target_size_m.size() != 2)
    table.complain("target_size_m", "must be two numbers, width and height");
  if (block.target_normal.size() == 3 &&
      std::hypot(block.target_normal[0], block.target_normal[1], block.target_normal[2]) < 1e-9) {
    table.complain("target_normal", "has length 0 and points nowhere");
  }
  const auto of_poses = has_poses ? table.anew().tables("pose") : std::vector<Table>{};
  for (std::size_t i = 0; i < of_poses.size(); ++i) {
    double squares = 0.0;
    for (const double q : block.poses[i].rotation_wxyz) squares += q * q;
    if (squares >= 1e-12) continue;
    table.complain("pose", fmt::format("{} at {}: rotation_wxyz is all zeros, which is no rotation", i + 1,
                                       of_poses[i].place("rotation_wxyz")));
  }
}

/// What a block's poses are to be told by must be there.
void checkPoseFrom(const Plan& plan, const BlockSpec& block, Table& table) {
  const bool needs_board = block.pose_from == PoseFrom::Board || block.pose_from == PoseFrom::BoardAndRig;
  if (needs_board && !plan.board.isThere())
    table.complain("pose_from", "needs a [board] that says what the board is and where it stands");
  if (needs_board && plan.board.isThere()) {
    const auto board = intrinsics::targetOf(plan.board.words());
    const auto told = board ? intrinsics::tellsItsPose(*board) : Result<>{board.error()};
    if (!told) table.complain("pose_from", fmt::format("needs another [board]: {}", told.error().message));
  }
  if (block.pose_from != PoseFrom::Command && block.kind == Kind::Dark)
    table.complain("pose_from", "has no meaning for kind = \"dark\": nothing is seen there");
  for (const PlaneSpec& plane : plan.planes) {
    if (std::hypot(plane.normal[0], plane.normal[1], plane.normal[2]) >= 1e-9) continue;
    table.complain("pose_from", "needs planes whose normal has a length other than 0");
    return;
  }
  if (block.pose_from != PoseFrom::Planes) return;
  std::vector<intrinsics::KnownPlane> known;
  for (const PlaneSpec& plane : plan.planes) known.push_back(plane.known());
  if (auto told = intrinsics::tellThePose(known); !told)
    table.complain("pose_from", fmt::format("needs three [[plane]]s or more that span space: {}", told.error().message));
}

/// What each kind needs so that it can do what it is for.
void checkKind(const BlockSpec& block, Table& table) {
  const std::size_t distances = different(block.distance_m), angles = different(block.angle_deg);
  const std::size_t exposures = different(block.exposures, microsecond),
                    ambients = different(block.ambients, kilolux);
  const std::size_t poses = block.poses.size();
  const auto need = [&](bool holds, std::string_view key, std::string_view what) {
    if (!holds) table.complain(key, fmt::format("{} (kind = \"{}\")", what, nameOf(block.kind)));
  };
  switch (block.kind) {
    case Kind::WarmUp:
      need(conditionsOf(block) == 1, "",
           "must have one pose, exposure and ambient: nothing but time may change");
      need(block.repeats >= 3, "repeats", "must be at least 3: a drift is a curve over time");
      break;
    case Kind::Distance:
      need(distances >= 3 || poses >= 3, "distance_m", "must have at least three different distances");
      break;
    case Kind::Exposure:
      need(exposures >= 2, "exposure_us", "must have at least two different exposure times");
      break;
    case Kind::Ambient:
      need(ambients >= 2, "ambient_klx", "must have at least two different values");
      break;
    case Kind::Tilt:
      need(angles >= 2 || poses >= 2, "angle_deg", "must have at least two different angles");
      break;
    case Kind::BrightDark:
      need(poses >= 2, "pose", "must have at least two poses, a bright and a dark one, that take turns");
      need(block.repeats >= 2, "repeats",
           "must be at least 2: what is left of the frame before shows in turns");
      break;
    case Kind::Corner:
      need(block.corner_deg > 0.0, "corner_deg", "must say the angle between the walls");
      break;
    case Kind::Moving:
      need(block.speed_m_per_s > 0.0, "speed_m_per_s", "must say how fast the plate moves");
      break;
    case Kind::Repeats:
      need(block.captures > 0, "captures", "must say how many earlier conditions are captured again");
      break;
    case Kind::Checkerboard:
    case Kind::Foreground:
    case Kind::Scatter:
    case Kind::Dark:
    case Kind::NearField:
    case Kind::Locked:
      break;
  }
}

/// Keys that mean nothing for the kind are mistakes, too.
void checkMeaning(const BlockSpec& block, Table& table) {
  struct Rule {
    const char* key;
    bool has_meaning;
  };
  const bool is_repeats = block.kind == Kind::Repeats;
  const std::array rules{
      Rule{"corner_deg", block.kind == Kind::Corner},
      Rule{"speed_m_per_s", block.kind == Kind::Moving},
      Rule{"captures", is_repeats},
      Rule{"of", is_repeats},
      Rule{"exposure_us", !is_repeats},
      Rule{"ambient_klx", !is_repeats},
      Rule{"locked", !is_repeats && block.kind != Kind::Locked && block.kind != Kind::WarmUp},
      Rule{"order", block.kind != Kind::BrightDark && block.kind != Kind::WarmUp}};
  for (const Rule& rule : rules) {
    if (table.has(rule.key) && !rule.has_meaning) {
      table.complain(rule.key, fmt::format("has no meaning for kind = \"{}\"", nameOf(block.kind)));
    }
  }
  if (rules[6].has_meaning && static_cast<std::size_t>(block.locked) >= conditionsOf(block) &&
      block.locked > 0) {
    table.complain("locked",
                   fmt::format("= {} leaves none of the block's {} conditions open; a block of held-back "
                               "captures only is of kind = \"locked\"",
                               block.locked, conditionsOf(block)));
  }
  if (conditionsOf(block) * static_cast<std::size_t>(block.repeats) > 100'000) {
    table.complain("repeats", "makes more than 100,000 captures of this block");
  }
}

void checkRepeats(const Plan& plan, std::size_t at, Table& table) {
  const BlockSpec& block = plan.blocks[at];
  for (const std::string& name : block.of) {
    const auto end = plan.blocks.begin() + static_cast<std::ptrdiff_t>(at);
    const auto found =
        std::find_if(plan.blocks.begin(), end, [&](const BlockSpec& b) { return b.name == name; });
    if (found == end)
      table.complain("of", fmt::format("names \"{}\", which is no block before this one", name));
  }
}

void checkNames(const Plan& plan, std::vector<Table>& tables) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < plan.blocks.size(); ++i) {
    const std::string& name = plan.blocks[i].name;
    if (name.empty()) tables[i].complain("", "is a [[block]] without a name");
    if (name.find_first_of("/\\\"\n") != std::string::npos)
      tables[i].complain("name", "must not have / \\ \" in it");
    if (!name.empty() && !names.insert(name).second) {
      tables[i].complain("name", fmt::format("= \"{}\": another block is called so", name));
    }
  }
}

void checkWhole(const Plan& plan, Table& table, std::vector<Table>& tables) {
  if (plan.blocks.empty()) table.complain("", "has no [[block]]: a plan is made of them");
  if (std::hypot(plan.target_normal[0], plan.target_normal[1], plan.target_normal[2]) < 1e-9) {
    table.complain("target_normal", "has length 0 and points nowhere");
  }
  if (!plan.target_size_m.empty() && plan.target_size_m.size() != 2)
    table.complain("target_size_m", "must be two numbers, width and height");
  for (std::size_t i = 0; i < plan.blocks.size(); ++i) {
    if (plan.blocks[i].exposures.empty() || plan.exposure > Duration{}) continue;
    tables[i].complain("exposure_us",
                       "changes the exposure, so the plan must say at its top which one the other "
                       "blocks have: exposure_us = …");
  }
}

Result<Plan> read(Table table, const std::vector<std::string>& skip) {
  Plan plan;
  table.read(plan);
  auto tables = table.has("block") ? table.tables("block") : std::vector<Table>{};
  for (Table& one : tables) one.acceptAll();
  checkNames(plan, tables);
  for (std::size_t i = 0; i < plan.blocks.size(); ++i) {
    checkPlaces(plan.blocks[i], tables[i]);
    checkPoseFrom(plan, plan.blocks[i], tables[i]);
    checkKind(plan.blocks[i], tables[i]);
    checkMeaning(plan.blocks[i], tables[i]);
    checkRepeats(plan, i, tables[i]);
  }
  checkWhole(plan, table, tables);
  if (auto checked = table.check(); !checked) return checked.error();
  for (const std::string& name : skip) {
    const auto found = std::ranges::find(plan.blocks, name, &BlockSpec::name);
    if (found == plan.blocks.end()) {
      return Error{Error::Code::InvalidArgument, fmt::format("there is no block \"{}\" to skip", name)};
    }
    plan.blocks.erase(found);
  }
  if (plan.blocks.empty())
    return Error{Error::Code::InvalidArgument, "all blocks are skipped: nothing is left"};
  return plan;
}

}  // namespace

std::string_view nameOf(Kind kind) {
  for (const KindName& one : kKinds) {
    if (one.kind == kind) return one.name;
  }
  return {};
}

Result<Plan> loadPlan(const std::filesystem::path& file, const std::vector<std::string>& skip) {
  auto table = Table::load(file);
  return table ? read(*std::move(table), skip) : table.error();
}

Result<Plan> parsePlan(std::string_view toml, const std::filesystem::path& name,
                       const std::vector<std::string>& skip) {
  auto table = Table::parse(toml, name);
  return table ? read(*std::move(table), skip) : table.error();
}

std::string documentPlan() { return settings::markdownTable(settings::keysOf<Plan>()); }

}  // namespace toftwin::plan
