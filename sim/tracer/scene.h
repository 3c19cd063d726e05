// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>
#include <toftwin/units.h>

#include "sim/tracer/scene_loading.h"

namespace toftwin::sim {

/// In which light a scene is seen: the cameras' own, or what a colour camera's filters let through.
enum class Band { Infrared, Red, Green, Blue };

struct ForeignEmitterSpec;

/// A built scene: meshes and primitives with their materials, ready to trace. Cheap to copy; copies
/// share the geometry, which nobody changes.
class Scene {
 public:
  /// From a scene file (docs/scene.md). Errors name file, line and key; a mesh that is missing, empty
  /// or holds NaN vertices is an error naming mesh and vertex.
  static Result<Scene> load(const std::filesystem::path& file, Band band = Band::Infrared, const SceneLoading& how = {});
  /// From text; `name` stands for the file in errors, and mesh paths start at its folder.
  static Result<Scene> parse(std::string_view toml, const std::filesystem::path& name,
                             Band band = Band::Infrared, const SceneLoading& how = {});

  /// Content hash over what the scene says and the meshes it uses; 32 hex digits. Comments, order of
  /// keys and file names do not count.
  [[nodiscard]] const std::string& id() const;

  /// What people should know of its meshes: triangles that were left out, a size that cannot be meant.
  [[nodiscard]] const std::vector<std::string>& notes() const;

  /// Whether anything in it moves by itself.
  [[nodiscard]] bool moves() const;
  /// The scene as it stands at a time after its start, with the same id. Still geometry is shared; what
  /// moves is placed anew, which takes microseconds and some nanoseconds for each of its triangles.
  [[nodiscard]] Scene at(Duration time) const;

  /// Light of other cameras, which trace() leaves out; foreign.h adds it.
  [[nodiscard]] const std::vector<ForeignEmitterSpec>& foreignEmitters() const;

  struct Impl;
  [[nodiscard]] const Impl& impl() const { return *impl_; }

 private:
  explicit Scene(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
  friend struct SceneBuilder;
  std::shared_ptr<const Impl> impl_;  // shared by copies: tracing threads and the driver
};

}  // namespace toftwin::sim
