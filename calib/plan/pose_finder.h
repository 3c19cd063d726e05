// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <toftwin/frame.h>
#include <toftwin/geometry.h>
#include <toftwin/result.h>

#include "calib/plan/plan.h"

namespace toftwin::plan {

/// Of poses that the rig told by where the cameras had seen the board before.
inline constexpr const char* kByBoardAndRig = "rig with the board's help";

/// Where a camera stood, by what it saw.
struct SeenPose {
  Transform<World, Camera> world_from_camera{};
  /// Half widths of the 95 % intervals: turns about the world's axes (rad), then the pinhole's place (m).
  std::array<double, 6> half_widths{};
  std::string by{};    ///< "board", "planes", "rig with the board's help"
  std::string what{};  ///< "40 corners, 0.08 px RMS"
};

/// Tells the poses of a plan's blocks from frames. With a rig it remembers what was seen from where, so that
/// the camera's place on the rig becomes known (hand-eye).
class PoseFinder {
 public:
  explicit PoseFinder(const Plan& plan);

  /// `about`: where the camera stands, about; planes need it to tell which is which, and with a rig it is
  /// what the rig says. Errors say what is not seen, and why.
  Result<SeenPose> find(PoseFrom from, std::span<const Frame> frames,
                        const std::optional<Transform<World, Camera>>& about);

 private:
  struct Memory;
  Plan plan_;
  std::shared_ptr<Memory> memory_;
};

/// The turn between two poses about the world's axes (rad) and the shift (m).
std::array<double, 6> between(const Transform<World, Camera>& from, const Transform<World, Camera>& to);
/// Empty where two poses agree within their intervals and `tolerance`; else by how much they do not.
std::string disagreement(const SeenPose& one, const Transform<World, Camera>& other,
                         const std::array<double, 6>& other_half_widths, const BoardSpec& tolerance);
/// "x 0.3, y 0.2, z 1.1 mm; turned by 0.05, 0.04, 0.01°".
std::string inWords(const std::array<double, 6>& half_widths);

}  // namespace toftwin::plan
