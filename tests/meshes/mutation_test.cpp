// SPDX-License-Identifier: Apache-2.0
// Damaged files of each format: whatever is read of them is whole.
#include <algorithm>
#include <cmath>
#include <random>

#include "tests/meshes/mesh_folder.h"

namespace toftwin::sim::meshes::testing {
namespace {

class Mutants : public MeshFolder {
 protected:
  /// Bytes changed, cut out, doubled, or replaced by others that numbers and lengths are made of.
  static std::string mutant(std::string bytes, std::mt19937& random) {
    const auto below = [&](std::size_t count) { return std::uniform_int_distribution<std::size_t>{0, count - 1}(random); };
    static const std::vector<std::string> kNasty{"-1", "999999999", "1e308", "nan", "\xff\xff\xff\xff", "\n", " ", "[", "{", "\"", "0"};
    for (std::size_t changes = 1 + below(4); changes > 0 && !bytes.empty(); --changes) {
      const std::size_t at = below(bytes.size());
      switch (below(5)) {
        case 0:
          bytes[at] = static_cast<char>(below(256));
          break;
        case 1:
          bytes.erase(at, 1 + below(16));
          break;
        case 2:
          bytes.insert(at, bytes.substr(at, 1 + below(64)));
          break;
        case 3:
          bytes.resize(at);
          break;
        default:
          bytes.replace(at, 1, kNasty[below(kNasty.size())]);
      }
    }
    return bytes;
  }

  void survive(const std::string& name, const std::string& bytes) {
    const unsigned seed = std::random_device{}();
    std::mt19937 random{seed};
    for (int i = 0; i < 500; ++i) {
      const auto mesh = read(name, mutant(bytes, random));
      if (!mesh) {
        EXPECT_THAT(mesh.error().message, ::testing::HasSubstr(name)) << "seed " << seed << ", mutant " << i;
        continue;
      }
      for (const auto& triangle : mesh->mesh.triangles) {
        for (const std::uint32_t vertex : triangle) {
          ASSERT_LT(vertex, mesh->mesh.vertices.size()) << "seed " << seed << ", mutant " << i;
          ASSERT_TRUE(std::isfinite(mesh->mesh.vertices[vertex].x)) << "seed " << seed << ", mutant " << i;
        }
      }
    }
  }
};

TEST_F(Mutants, OfPlyAreReadOrNamed) {
  std::string binary = "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                       "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
  for (int i = 0; i < 12; ++i) append(binary, static_cast<float>(i % 5));
  for (const int first : {0, 1}) {
    binary += '\3';
    for (int k = 0; k < 3; ++k) append(binary, first + k);
  }
  survive("a.ply", binary);
  survive("b.ply", "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
                   "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
}

TEST_F(Mutants, OfObjAreReadOrNamed) {
  survive("a.obj", "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nvt 0 0\nf 1/1 2/1 3/1 4/1 5/1 6/1\nf -1 -2 -3\n");
}

TEST_F(Mutants, OfStlAreReadOrNamed) {
  survive("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n");
}

TEST_F(Mutants, OfGltfAreReadOrNamed) {
  survive("a.gltf", R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"translation":[0,0,0.5]}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],
"textures":[{"source":0}],"images":[{"bufferView":0,"mimeType":"image/png"}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[-1,-1,0],"max":[3,3,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AACAvwAAgL8AAAAAAABAQAAAgL8AAAAAAACAvwAAQEAAAAAA"}]})");
}

}  // namespace
}  // namespace toftwin::sim::meshes::testing
