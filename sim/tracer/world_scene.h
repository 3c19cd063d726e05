// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "sim/tracer/scene_file.h"
#include "sim/tracer/scene_loading.h"

namespace toftwin::sim {

/// A joint of a URDF, in the file beside it.
struct JointSpec {
  std::string name;
  double position = 0.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.text("name", name, "of a joint of the URDF");
    v.number("position", position, {-1e6, 1e6}, "where it stands: radian, or metre of a prismatic one; others stand at 0");
  }
};

/// The keys of FILE.toml beside a world FILE, but for [ambient] and [[foreign_emitter]], which are a scene file's.
struct WorldSpec {
  std::vector<std::string> model_path, package_path;
  std::vector<JointSpec> joints;

  template <class Visitor>
  void visit(Visitor& v) {
    v.texts("model_path", model_path, "SDF: folders in which model:// is looked for first, relative to this file");
    v.texts("package_path", package_path, "URDF: folders in which package:// is looked for first, relative to this file");
    v.group("joint", joints, "URDF: where joints stand");
  }
};

/// Whether a file is a world that others made, by its extension: .sdf, .world, .urdf, .gltf, .glb.
bool isWorld(const std::filesystem::path& file);

/// An SDF, URDF or glTF file as a scene, in its own frame: metres, z up (glTF: y up). Its visible things are objects
/// by their names. Materials: the first [[material]] of the file beside it whose `match` (* and ? stand for any text
/// and any letter) fits the object's name or that of its surface in the file; else what the file says of the
/// surface; else matt with an albedo of 0.5. Errors name all that is wrong.
Result<SceneFile> loadWorld(const std::filesystem::path& file, const SceneLoading& how);

}  // namespace toftwin::sim
