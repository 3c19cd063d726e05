// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <unordered_map>

#include "sim/meshes/faces.h"
#include "sim/meshes/formats.h"
#include "sim/meshes/gltf_model.h"
#include "sim/meshes/gltf_values.h"

namespace toftwin::sim::meshes {
namespace {

/// Of all nodes together: a small file may show one mesh many times.
constexpr std::size_t kMostTriangles = 5'000'000;

constexpr std::array<TexturePlace, 3> kNoPlaces{{{NAN, NAN}, {NAN, NAN}, {NAN, NAN}}};

/// Columns of a 3 × 4 matrix: the axes of a frame and its origin, in another.
struct Placement {
  std::array<Vec3d, 4> columns{Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}, Vec3d{}};

  [[nodiscard]] Vec3d turned(Vec3d v) const { return columns[0] * v.x + columns[1] * v.y + columns[2] * v.z; }
  [[nodiscard]] Vec3d placed(Vec3d p) const { return turned(p) + columns[3]; }
  [[nodiscard]] Placement after(const Placement& first) const {
    return {{turned(first.columns[0]), turned(first.columns[1]), turned(first.columns[2]), placed(first.columns[3])}};
  }
};

/// A node's own matrix, or translation · rotation · scale [glTF 2.0, section 3.5.3]; quaternions are x, y, z, w.
Placement placementOf(const tinygltf::Node& node) {
  Placement own;
  if (node.matrix.size() == 16) {
    for (std::size_t c = 0; c < 4; ++c) own.columns[c] = {node.matrix[4 * c], node.matrix[4 * c + 1], node.matrix[4 * c + 2]};
    return own;
  }
  Transform<World, World> turn;
  if (node.rotation.size() == 4) {
    const auto& q = node.rotation;
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (length > 0.0) turn.rotation_wxyz = {q[3] / length, q[0] / length, q[1] / length, q[2] / length};
  }
  for (std::size_t c = 0; c < 3; ++c)
    own.columns[c] = turn.rotate(own.columns[c]) * (node.scale.size() == 3 ? node.scale[c] : 1.0);
  if (node.translation.size() == 3) own.columns[3] = {node.translation[0], node.translation[1], node.translation[2]};
  return own;
}

class GltfReader {
 public:
  GltfReader(const GltfModel& model, const std::filesystem::path& file, const std::stop_token& stop)
      : model_(*model), file_(file), stop_(stop), is_reached_(model_.nodes.size(), false) {}

  /// Nodes from the roots down, without recursion: a chain of them may be long.
  Result<MeshFile> read() {
    std::vector<Pending> pending;  // the next one is the last
    const std::vector<int> all = roots();
    for (auto root = all.rbegin(); root != all.rend(); ++root) pending.push_back({*root, {}});
    while (!pending.empty()) {
      if (stop_.stop_requested()) return askedToStop();
      const Pending next = pending.back();
      pending.pop_back();
      const auto number = static_cast<std::size_t>(next.node);
      if (number >= model_.nodes.size()) return damaged(file_, fmt::format("there is no node {}", next.node));
      if (is_reached_[number])
        return damaged(file_, fmt::format("node {} has two parents, or is below itself", next.node));
      is_reached_[number] = true;
      const tinygltf::Node& node = model_.nodes[number];
      const Placement placement = next.world_from_parent.after(placementOf(node));
      if (auto added = addNode(node, number, placement); !added) return added.error();
      for (auto child = node.children.rbegin(); child != node.children.rend(); ++child) pending.push_back({*child, placement});
    }
    if (!read_.mesh.places.empty()) read_.mesh.places.resize(read_.mesh.triangles.size(), kNoPlaces);
    if (!model_.animations.empty()) read_.notes.push_back("its animations are left out");
    if (!model_.skins.empty()) read_.notes.push_back("its skins are left out: meshes stand as they were modelled");
    if (has_other_primitives_) read_.notes.push_back("its points and lines are left out");
    return std::move(read_);
  }

 private:
  struct Pending {
    int node;
    Placement world_from_parent;
  };

  /// Those of the scene that is shown; in a file without scenes, the nodes that are no one's children.
  [[nodiscard]] std::vector<int> roots() const {
    const auto shown = static_cast<std::size_t>(std::max(model_.defaultScene, 0));
    if (shown < model_.scenes.size()) return model_.scenes[shown].nodes;
    std::vector<bool> is_child(model_.nodes.size(), false);
    for (const auto& node : model_.nodes) {
      for (const int child : node.children) {
        if (static_cast<std::size_t>(child) < is_child.size()) is_child[static_cast<std::size_t>(child)] = true;
      }
    }
    std::vector<int> all;
    for (std::size_t i = 0; i < is_child.size(); ++i) {
      if (!is_child[i]) all.push_back(static_cast<int>(i));
    }
    return all;
  }

  Result<> addNode(const tinygltf::Node& node, std::size_t number, const Placement& placement) {
    if (node.mesh < 0) return {};
    const auto mesh_number = static_cast<std::size_t>(node.mesh);
    if (mesh_number >= model_.meshes.size())
      return damaged(file_, fmt::format("node {} shows mesh {}, which is not there", number, node.mesh));
    const tinygltf::Mesh& mesh = model_.meshes[mesh_number];
    const std::string name = !node.name.empty()   ? node.name
                             : !mesh.name.empty() ? mesh.name
                                                  : fmt::format("node {}", number);
    for (const tinygltf::Primitive& primitive : mesh.primitives) {
      if (auto added = addPrimitive(primitive, name, placement); !added) return added;
    }
    return {};
  }

  Result<> addPrimitive(const tinygltf::Primitive& primitive, const std::string& name, const Placement& placement) {
    const bool is_strip = primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP, is_fan = primitive.mode == TINYGLTF_MODE_TRIANGLE_FAN;
    const auto position = primitive.attributes.find("POSITION");
    if (!is_strip && !is_fan && primitive.mode != TINYGLTF_MODE_TRIANGLES && primitive.mode != -1) {
      has_other_primitives_ = true;
      return {};
    }
    if (position == primitive.attributes.end()) return {};  // it shows nothing, says the specification
    const auto positions = GltfValues::of(model_, position->second, 3, file_);
    if (!positions) return positions.error();
    std::optional<GltfValues> indices;
    if (primitive.indices >= 0) {
      auto found = GltfValues::of(model_, primitive.indices, 1, file_);
      if (!found) return found.error();
      if (!found->isUnsigned()) return damaged(file_, fmt::format("accessor {} is no list of indices", primitive.indices));
      indices = *found;
    }
    Part part{name, read_.mesh.triangles.size(), 0, std::nullopt};
    if (const auto material = static_cast<std::size_t>(primitive.material); material < model_.materials.size()) part.surface = material;
    const auto places = placesOf(primitive);
    if (!places) return places.error();
    Corners corners{*positions, *places, indices, placement, {}};
    const std::size_t count = indices ? indices->count() : positions->count();
    const std::size_t triangles = is_strip || is_fan ? (count < 3 ? 0 : count - 2) : count / 3;
    if (triangles > kMostTriangles - read_.mesh.triangles.size()) {
      return Error{Error::Code::TooLarge, fmt::format("mesh {}: its nodes show more than {} triangles; leave some out",
                                                      file_.string(), kMostTriangles)};
    }
    for (std::size_t t = 0; t < triangles; ++t) {
      if (t % 65'536 == 0 && stop_.stop_requested()) return askedToStop();
      const std::size_t odd = t % 2;
      const std::array<std::size_t, 3> of_triangle =
          is_strip ? std::array{t, t + 1 + odd, t + 2 - odd} : is_fan ? std::array<std::size_t, 3>{0, t + 1, t + 2}
                                                                      : std::array{3 * t, 3 * t + 1, 3 * t + 2};
      if (auto added = addTriangle(of_triangle, corners); !added) return added;
    }
    part.count = triangles;
    read_.parts.push_back(std::move(part));
    return {};
  }

  /// Of the set of coordinates that the material's picture uses.
  Result<std::optional<GltfValues>> placesOf(const tinygltf::Primitive& primitive) const {
    const auto material = static_cast<std::size_t>(primitive.material);
    const int set = material < model_.materials.size() ? model_.materials[material].pbrMetallicRoughness.baseColorTexture.texCoord : 0;
    const auto found = primitive.attributes.find(fmt::format("TEXCOORD_{}", set));
    if (found == primitive.attributes.end()) return std::optional<GltfValues>{};
    auto values = GltfValues::of(model_, found->second, 2, file_);
    if (!values) return values.error();
    return std::optional{*values};
  }

  /// Where a primitive's corners come from; only vertices that are used are taken over.
  struct Corners {
    GltfValues positions;
    std::optional<GltfValues> places, indices;
    Placement placement;
    std::unordered_map<std::uint32_t, std::uint32_t> taken;
  };

  Result<> addTriangle(const std::array<std::size_t, 3>& of_triangle, Corners& corners) {
    std::array<std::uint32_t, 3> triangle{};
    std::array<TexturePlace, 3> places = kNoPlaces;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex =
          corners.indices ? corners.indices->index(of_triangle[k]) : static_cast<std::uint32_t>(of_triangle[k]);
      if (vertex >= corners.positions.count())
        return damaged(file_, fmt::format("a triangle refers to vertex {}, but there are {}", vertex, corners.positions.count()));
      const auto [found, is_new] = corners.taken.emplace(vertex, static_cast<std::uint32_t>(read_.mesh.vertices.size()));
      if (is_new) {
        const GltfValues& p = corners.positions;
        read_.mesh.vertices.push_back(corners.placement.placed({p.at(vertex, 0), p.at(vertex, 1), p.at(vertex, 2)}));
      }
      triangle[k] = found->second;
      if (!corners.places || vertex >= corners.places->count()) continue;
      places[k] = {static_cast<float>(corners.places->at(vertex, 0)), static_cast<float>(corners.places->at(vertex, 1))};
    }
    if (corners.places) {
      read_.mesh.places.resize(read_.mesh.triangles.size(), kNoPlaces);  // of parts before this one
      read_.mesh.places.push_back(places);
    }
    read_.mesh.triangles.push_back(triangle);
    return {};
  }

  const tinygltf::Model& model_;
  const std::filesystem::path& file_;
  const std::stop_token& stop_;
  std::vector<bool> is_reached_;
  bool has_other_primitives_ = false;
  MeshFile read_;
};

}  // namespace

Result<MeshFile> readGltf(std::string_view bytes, const std::filesystem::path& file, const std::stop_token& stop) {
  const auto model = GltfModel::parse(bytes, file);
  if (!model) return model.error();
  auto read = GltfReader{*model, file, stop}.read();
  if (!read) return read;
  auto surfaces = model->surfaces(file, read->notes);
  if (!surfaces) return surfaces.error();
  read->surfaces = *std::move(surfaces);
  if (auto finite = checkVertices(read->mesh.vertices, file); !finite) return finite.error();
  if (auto left = leaveOutFlat(*read, file); !left) return left.error();
  return read;
}

}  // namespace toftwin::sim::meshes
