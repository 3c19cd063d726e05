// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/mesh.h"

#include <fmt/format.h>

#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <cmath>

namespace toftwin::sim {
namespace {

/// Appends a node's meshes, and those of the nodes below it.
Result<> append(const aiScene& scene, const aiNode& node, const aiMatrix4x4& world_from_parent,
                const std::filesystem::path& file, TriangleMesh& mesh) {
  const aiMatrix4x4 world_from_node = world_from_parent * node.mTransformation;
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    const aiMesh& part = *scene.mMeshes[node.mMeshes[m]];
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (unsigned i = 0; i < part.mNumVertices; ++i) {
      const aiVector3D v = world_from_node * part.mVertices[i];
      if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) {
        return Error{Error::Code::InvalidArgument,
                     fmt::format("{}: vertex {} of mesh {} \"{}\" is not finite ({}, {}, {}); mend the file",
                                 file.string(), i, node.mMeshes[m], part.mName.C_Str(), v.x, v.y, v.z)};
      }
      mesh.vertices.push_back({static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)});
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;
      for (unsigned k = 0; k < 3; ++k) {
        if (face.mIndices[k] >= part.mNumVertices) {
          return Error{Error::Code::InvalidArgument,
                       fmt::format("{}: face {} refers to vertex {}, but there are {}; mend the file",
                                   file.string(), f, face.mIndices[k], part.mNumVertices)};
        }
      }
      mesh.triangles.push_back({first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
      if (!part.HasTextureCoords(0)) continue;
      auto& places = mesh.places.emplace_back();
      for (unsigned k = 0; k < 3; ++k) {
        const aiVector3D at = part.mTextureCoords[0][face.mIndices[k]];  // from the picture's bottom up
        places[k] = {at.x, 1.0f - at.y};
      }
    }
  }
  for (unsigned c = 0; c < node.mNumChildren; ++c) {
    if (auto below = append(scene, *node.mChildren[c], world_from_node, file, mesh); !below) return below;
  }
  return {};
}

}  // namespace

Result<TriangleMesh> loadMesh(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("mesh {}: it is a folder; name the file in it", file.string())};
  }
  if (!std::filesystem::is_regular_file(file, ignored)) {
    return Error{Error::Code::NotFound,
                 fmt::format("mesh {}: no such file; paths are relative to the scene file", file.string())};
  }
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(file.string(), aiProcess_Triangulate);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    const std::string kind = file.extension().string();
    const bool is_known = !kind.empty() && importer.IsExtensionSupported(kind);
    return Error{Error::Code::Malformed,
                 fmt::format("mesh {}: {}", file.string(),
                             is_known ? fmt::format("it cannot be read as {}: damaged, cut off, or "
                                                    "another format (Assimp: {})",
                                                    kind, importer.GetErrorString())
                                      : std::string{"its extension is of no format that can be read; "
                                                    "OBJ, PLY, glTF and GLB can"})};
  }
  TriangleMesh mesh;
  if (auto read = append(*scene, *scene->mRootNode, aiMatrix4x4{}, file, mesh); !read) return read.error();
  if (mesh.places.size() != mesh.triangles.size()) mesh.places.clear();
  if (mesh.triangles.empty()) {
    return Error{Error::Code::InvalidArgument, fmt::format("mesh {}: it has no triangles", file.string())};
  }
  const bool has_area = std::ranges::any_of(mesh.triangles, [&](const auto& corners) {
    const auto& [a, b, c] = corners;
    return norm(cross(mesh.vertices[b] - mesh.vertices[a], mesh.vertices[c] - mesh.vertices[a])) > 0.0;
  });
  if (!has_area) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("mesh {}: none of its {} triangles has an area", file.string(), mesh.triangles.size())};
  }
  return mesh;
}

TriangleMesh rectangleMesh(double size_x, double size_y) {
  const double x = size_x / 2.0, y = size_y / 2.0;
  constexpr TexturePlace kTopLeft{0.0f, 0.0f}, kTopRight{1.0f, 0.0f}, kBottomRight{1.0f, 1.0f}, kBottomLeft{0.0f, 1.0f};
  return {{{-x, -y, 0.0}, {x, -y, 0.0}, {x, y, 0.0}, {-x, y, 0.0}},
          {{0, 1, 2}, {0, 2, 3}},
          {{kTopLeft, kTopRight, kBottomRight}, {kTopLeft, kBottomRight, kBottomLeft}}};
}

TriangleMesh boxMesh(double size_x, double size_y, double size_z) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.push_back({((i & 1) != 0 ? 0.5 : -0.5) * size_x, ((i & 2) != 0 ? 0.5 : -0.5) * size_y,
                             ((i & 4) != 0 ? 0.5 : -0.5) * size_z});
  }
  // Each side as the four corners around it.
  constexpr std::array<std::array<std::uint32_t, 4>, 6> kSides{
      {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}}};
  for (const auto& side : kSides) {
    mesh.triangles.push_back({side[0], side[1], side[2]});
    mesh.triangles.push_back({side[0], side[2], side[3]});
    mesh.places.push_back({TexturePlace{0.0f, 0.0f}, {1.0f, 0.0f}, {1.0f, 1.0f}});
    mesh.places.push_back({TexturePlace{0.0f, 0.0f}, {1.0f, 1.0f}, {0.0f, 1.0f}});
  }
  return mesh;
}

}  // namespace toftwin::sim
