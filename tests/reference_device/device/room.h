// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include <toftwin/geometry.h>
#include <toftwin/result.h>

namespace toftwin::reference {

/// A matt rectangle with two sides: centre + u a + v b with |u|, |v| <= 1, a and b perpendicular half edges.
struct Board {
  Vec3d centre_m{}, a_m{}, b_m{};
  Vec3d normal{};  ///< unit
  double albedo = 0.5;
};

/// What stands before the camera: boards only. Boxes of a scene file become six boards.
struct Room {
  std::vector<Board> boards;
};

/// Reads rectangles and boxes of Lambertian material from a scene file (docs/scene.md). Anything else is an
/// error, so that nothing that stands there is left out silently.
Result<Room> readRoom(const std::filesystem::path& scene);

/// Where a ray meets a board first.
struct Meeting {
  std::size_t board = 0;
  double distance_m = 0.0;
};
/// Beyond `least_m`; direction of unit length.
std::optional<Meeting> firstMeeting(const Room& room, Vec3d origin_m, Vec3d direction, double least_m = 1e-9);
/// From a place to the nearest one on a board.
double distanceBetween(Vec3d place, const Board& board);
/// Paper on a board: what is between them is dark.
bool areStuckTogether(const Board& a, const Board& b);
/// Whether anything stands between two points; boards that either of them lies on do not count.
bool isHidden(const Room& room, Vec3d from_m, Vec3d to_m);

}  // namespace toftwin::reference
