// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <toftwin/geometry.h>
#include <toftwin/result.h>

#include "sim/meshes/mesh_file.h"

/// Worlds as robot people have them: SDF (Gazebo) and URDF (ROS). Both are metres with z up, and stay so here.
namespace toftwin::sim::worlds {

enum class Shape { Plane, Box, Sphere, Cylinder, Mesh };

/// A visible thing of a link.
struct Thing {
  std::string name;  ///< "pallet_3::link::visual", or "arm::visual" of a robot
  Shape shape = Shape::Box;
  Vec3d size_m{1, 1, 1};  ///< box: edges; plane: edges along x and y
  double radius_m = 0.5, height_m = 1.0;
  std::filesystem::path mesh;         ///< absolute
  Vec3d mesh_scale{1, 1, 1};
  Transform<World, Object> world_from_thing;
  bool has_surface = false;  ///< whether the file says how it looks; else a mesh's file may
  meshes::Surface surface;
};

struct WorldFile {
  std::vector<Thing> things;
  std::vector<std::string> notes;  ///< what was left out, for people
};

/// How a world is read beyond what its file says.
struct WorldOptions {
  std::vector<std::filesystem::path> search;  ///< folders of models and packages, absolute; before those of the environment
  std::map<std::string, double> joints;       ///< URDF: position by name, radian or metre; others stand at 0
};

/// An SDF world or model: models, also included and nested ones, links and their visuals. `model://NAME/…` is looked
/// for in the search folders, in those of GZ_SIM_RESOURCE_PATH, IGN_GAZEBO_RESOURCE_PATH, SDF_PATH and
/// GAZEBO_MODEL_PATH, beside the file and above it. Errors: all that libsdformat says is wrong.
Result<WorldFile> readSdf(const std::filesystem::path& file, const WorldOptions& options);

/// A URDF robot whose root link is the world. `package://NAME/…` is looked for in the search folders, in those of
/// ROS_PACKAGE_PATH and AMENT_PREFIX_PATH (share), beside the file and above it. A joint that it has not, or that
/// cannot be where it shall, is an error.
Result<WorldFile> readUrdf(const std::filesystem::path& file, const WorldOptions& options);

/// The file that a URI means (`scheme` is "model://" or "package://"); relative ones start at `folder`. Empty if it is not there.
std::filesystem::path fileOf(const std::string& uri, std::string_view scheme, const std::filesystem::path& folder,
                             const std::vector<std::filesystem::path>& search);
/// The folders that a list such as "/a:/b" in the environment names, those above `file` behind them.
std::vector<std::filesystem::path> searchFolders(const std::vector<std::filesystem::path>& first,
                                                 std::initializer_list<const char*> variables, const std::filesystem::path& file);

}  // namespace toftwin::sim::worlds
