// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>

#include <toftwin/fields.h>
#include <toftwin/units.h>

#include "calib/compare/poses.h"
#include "calib/intrinsics/planes.h"
#include "calib/intrinsics/target.h"

namespace toftwin::plan {

/// What says where the cameras stood: who put them there, or what they saw.
enum class PoseFrom { Command, Board, Planes, BoardAndRig };

/// A board that stands in the world, seen in the amplitude image.
struct BoardSpec {
  std::string corners{};
  std::string tags{};
  Length square{};
  Length marker{};
  std::string dictionary{};
  std::array<double, 3> position_m{0.0, 0.0, 2.0};
  std::array<double, 4> rotation_wxyz{1.0, 0.0, 0.0, 0.0};
  std::array<double, 3> euler_deg{};
  int frames = 4;
  Length agree = 20_mm;
  double agree_deg = 1.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("corners", corners,
           "inner corners as COLSxROWS, 8x5 for 9 × 6 squares; empty: no board, or one of tags");
    v.text("tags", tags,
           "tags as COLSxROWS of a grid of AprilTags or other markers, instead: number 0 at the top left, "
           "row by row");
    v.quantity("square", square, millimetre, {0.0, 10'000.0},
               "side of a square; tags: from the edge of one to the same edge of the next");
    v.quantity("marker", marker, millimetre, {0.0, 10'000.0},
               "side of a tag's dark border, or of a ChArUco board's markers; 0: a checkerboard");
    v.text("dictionary", dictionary,
           "of the markers, as OpenCV names it; empty: DICT_4X4_50, of tags DICT_APRILTAG_36h11");
    v.numbers("position_m", position_m, {-1e6, 1e6},
              "of the board's first corner in the world: inner corner, or the first tag's top left one");
    v.numbers("rotation_wxyz", rotation_wxyz, {-1.0, 1.0},
              "how the board is turned; as it is: x along its columns, y along its rows, seen from −z");
    v.numbers("euler_deg", euler_deg, {-360.0, 360.0},
              "how it is turned, instead of the quaternion: about the fixed world axes x, then y, then z");
    v.number("frames", frames, {1, 1000},
             "whose amplitude is averaged to look for it (or ranges for planes)");
    v.quantity("agree", agree, millimetre, {0.0, 10'000.0},
               "so far from it what is seen may be from what the rig, the camera or the other camera says, "
               "besides what is known of the uncertainty");
    v.number("agree_deg", agree_deg, {0.0, 180.0}, "the same for turns");
  }
  [[nodiscard]] bool isThere() const { return !corners.empty() || !tags.empty(); }
  [[nodiscard]] intrinsics::BoardWords words() const {
    return {.corners = corners, .tags = tags, .square = square, .marker = marker, .dictionary = dictionary};
  }
  [[nodiscard]] compare::PoseSpec pose() const {
    return {.position_m = position_m, .rotation_wxyz = rotation_wxyz, .euler_deg = euler_deg};
  }
};

/// A plane that stands in the world.
struct PlaneSpec {
  std::array<double, 3> point_m{};
  std::array<double, 3> normal{0.0, 0.0, -1.0};
  Length within = 100_mm;

  template <class Visitor>
  void visit(Visitor& v) {
    v.numbers("point_m", point_m, {-1e6, 1e6}, "on it, in the world");
    v.numbers("normal", normal, {-1.0, 1.0}, "of it, towards the cameras; any length but 0");
    v.quantity("within", within, millimetre, {0.1, 10'000.0},
               "pixels so near to where it is expected are of it");
  }
  [[nodiscard]] intrinsics::KnownPlane known() const {
    const Vec3d n = normalised(Vec3d{normal[0], normal[1], normal[2]});
    return {{n}, dot(n, Vec3d{point_m[0], point_m[1], point_m[2]})};
  }
};

}  // namespace toftwin::plan
