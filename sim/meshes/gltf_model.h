// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/result.h>

#include "sim/meshes/mesh_file.h"

// Only what is declared here; tiny_gltf.h brings its own JSON.
namespace tinygltf {
class Model;
}

namespace toftwin::sim::meshes {

/// A parsed glTF with its buffers, whose indices are not checked yet; pictures are not decoded.
class GltfModel {
 public:
  static Result<GltfModel> parse(std::string_view bytes, const std::filesystem::path& file);
  GltfModel(GltfModel&&) noexcept;
  GltfModel& operator=(GltfModel&&) noexcept;
  ~GltfModel();

  [[nodiscard]] const tinygltf::Model& operator*() const { return *model_; }
  [[nodiscard]] const tinygltf::Model* operator->() const { return model_.get(); }

  /// What the materials say, in their order; what of them is not taken over is noted.
  Result<std::vector<Surface>> surfaces(const std::filesystem::path& file, std::vector<std::string>& notes) const;

 private:
  explicit GltfModel(std::unique_ptr<tinygltf::Model> model);
  std::unique_ptr<tinygltf::Model> model_;
};

}  // namespace toftwin::sim::meshes
