// SPDX-License-Identifier: Apache-2.0
// Where the cameras stand, by what they see.
#include <fmt/format.h>

#include "calib/compare/follow.h"
#include "calib/plan/take.h"

namespace toftwin::plan {
namespace {

using compare::Feed;

const std::string& sourceOf(const Feed& feed) { return feed.details().entry.name; }

}  // namespace

Result<SeenPose> Taker::seenBy(const PlannedCapture& planned, Feed& feed, PoseFinder& finder,
                               const Taken& taken) {
  if (auto begun = feed.beginAnew(); !begun) return begun.error();
  std::vector<Frame> frames;
  while (frames.size() < static_cast<std::size_t>(plan_.board.frames)) {
    auto frame = compare::nextFrameAt(feed, saidBy(feed, taken), captureOptions());
    if (!frame) return frame.error();
    frames.push_back(*std::move(frame));
  }
  auto seen = finder.find(plan_.blocks[planned.block].pose_from, frames, taken.pose);
  if (seen) return seen;
  return Error{seen.error().code,
               fmt::format("where {} stands is not seen: {}", sourceOf(feed), seen.error().message)};
}

Result<> Taker::checkBoardOf(const PlannedCapture& planned, Feed& b) {
  const BlockSpec& block = plan_.blocks[planned.block];
  if (block.pose_from != PoseFrom::Board || !planned.pose || !b.details().can_set_pose) return {};
  Taken there;
  there.pose = planned.pose->world_from_camera();
  if (auto put = b.setPose(*there.pose); !put) return put;
  if (planned.exposure == Duration{} || compare::takes(b, compare::kExposure)) {
    if (auto set = setUp(planned, b, ""); !set) return set;
  }
  PoseFinder finder{plan_};
  const auto seen = seenBy(planned, b, finder, there);
  const std::string off = seen ? disagreement(*seen, *there.pose, {}, plan_.board) : "";
  if (seen && off.empty()) return {};
  const std::string what =
      seen ? fmt::format("poses disagree: {} by what {} sees ({}) and by where it was put are {}", planned.name,
                         sourceOf(b), seen->what, off)
           : fmt::format("{} does not see it: {}", sourceOf(b), seen.error().message);
  Error error{Error::Code::InvalidArgument,
              fmt::format("block \"{}\" takes its poses from the board, and {}", block.name, what)};
  // A board that is there, but too small, or an image that is not, no other scene mends.
  if (!seen && seen.error().code != Error::Code::NotFound) return error;
  const auto& [x, y, z] = plan_.board.position_m;
  error.message += fmt::format(
      ". What B looks at must have the board where the plan has it, its first corner at x {:.4g}, y {:.4g}, z {:.4g} "
      "m: put it into the scene of {} (a rectangle with the board's picture as its material's texture), or into that "
      "of a source \"NAME.BLOCK\" for this block",
      x, y, z, sourceOf(b));
  return error;
}

/// A sees where it stands. A twin that takes poses is put there; another camera must see the same place.
Result<> Taker::lookAround(const PlannedCapture& planned, Feed& a, Feed& b, Taken& taken) {
  const PoseFrom from = plan_.blocks[planned.block].pose_from;
  if (from == PoseFrom::Command) return {};
  if (from == PoseFrom::BoardAndRig && options_.carrier == nullptr)
    return Error{Error::Code::InvalidArgument,
                 "pose_from = \"board_and_rig\", but there is no rig: --rig names it"};
  const bool was_put = taken.pose_by == "camera" || taken.pose_by == "rig";
  auto seen = seenBy(planned, a, finder_a_, taken);
  if (!seen) return seen.error();
  // Where the camera sits on the rig is what the board is to tell.
  if (taken.pose && was_put && from != PoseFrom::BoardAndRig) {
    const std::string off = disagreement(*seen, *taken.pose, {}, plan_.board);
    if (!off.empty())
      return Error{Error::Code::InvalidArgument,
                   fmt::format("poses disagree: {} by what {} sees ({}) and by the {} are {}", planned.name,
                               sourceOf(a), seen->what, taken.pose_by, off)};
  }
  const auto commanded = taken.pose;
  if (!b.details().can_set_pose) {
    auto by_b = seenBy(planned, b, finder_b_, taken);
    if (!by_b) {
      return Error{by_b.error().code, fmt::format("{} sees where it stands ({}), the other does not: {}",
                                                  sourceOf(a), seen->what, by_b.error().message)};
    }
    const std::string off = disagreement(*seen, by_b->world_from_camera, by_b->half_widths, plan_.board);
    if (!off.empty())
      return Error{Error::Code::InvalidArgument, fmt::format("poses disagree: {} and {} stand at places {}",
                                                             sourceOf(a), sourceOf(b), off)};
    taken.seen_by_b = *std::move(by_b);
  } else if (auto put = b.setPose(seen->world_from_camera); !put) {
    return put.error();
  }
  says_[&a] = commanded, says_[&b] = b.details().can_set_pose ? seen->world_from_camera : commanded;
  taken.pose = seen->world_from_camera, taken.pose_by = seen->by, taken.seen = *std::move(seen);
  return {};
}

}  // namespace toftwin::plan
