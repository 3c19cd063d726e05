// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/geometry.h>
#include <toftwin/result.h>

#include "sim/tracer/scene_file.h"
#include "sim/tracer/scene_loading.h"

namespace toftwin::sim {

/// An object as it stands at device time 0.
struct ObjectSummary {
  std::string name;  ///< empty if the file gives none
  Shape shape = Shape::Box;
  std::string material;
  std::size_t triangles = 0;  ///< 0 of spheres, cylinders and discs, which are exact
  Vec3d lower_m, upper_m;     ///< of the box around it, along the world's axes
  bool moves = false;
};

struct SceneSummary {
  std::vector<ObjectSummary> objects;
  std::vector<MaterialSpec> materials;  ///< those that an object has
  std::vector<std::string> notes;
  Vec3d up, ahead;  ///< unit, as the surroundings have them

  [[nodiscard]] std::size_t triangles() const;
  [[nodiscard]] Vec3d lower() const;
  [[nodiscard]] Vec3d upper() const;
};

/// What is in a scene file or a world, its meshes read, nothing built.
Result<SceneSummary> summarise(const std::filesystem::path& file, const SceneLoading& how = {});

}  // namespace toftwin::sim
