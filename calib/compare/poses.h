// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/fields.h>
#include <toftwin/geometry.h>
#include <toftwin/result.h>

namespace toftwin::compare {

/// One pose of a pose file, as it is written.
struct PoseSpec {
  std::string name{};
  std::array<double, 3> position_m{};
  std::array<double, 4> rotation_wxyz{1.0, 0.0, 0.0, 0.0};
  std::array<double, 3> euler_deg{};

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "how the report calls it");
    v.numbers("position_m", position_m, {-1e6, 1e6}, "of the camera's pinhole in the world");
    v.numbers("rotation_wxyz", rotation_wxyz, {-1.0, 1.0},
              "how the camera is turned, a quaternion w, x, y, z; it is normalised");
    v.numbers("euler_deg", euler_deg, {-360.0, 360.0},
              "how it is turned, instead of the quaternion: about the fixed world axes x, then y, "
              "then z");
  }
  [[nodiscard]] Transform<World, Camera> world_from_camera() const;
};

/// A pose file: [[pose]] tables, in the order in which they are visited.
struct PoseFile {
  std::vector<PoseSpec> poses;

  template <class Visitor>
  void visit(Visitor& v) {
    v.group("pose", poses, "where the cameras stand, one after the other");
  }
};

/// Errors name file, line and key; a file without poses and a quaternion of length zero are errors.
Result<std::vector<PoseSpec>> loadPoses(const std::filesystem::path& file);

}  // namespace toftwin::compare
