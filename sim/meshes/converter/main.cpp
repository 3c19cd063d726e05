// SPDX-License-Identifier: Apache-2.0
// toftwin-convert-mesh FILE: any format that Assimp reads, as a binary PLY on standard output. A process of its
// own, because some of Assimp's readers trust what they read: what they do with a damaged file ends only this.
#include <sys/resource.h>

#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace {

constexpr rlim_t kMostMemory = rlim_t{1} << 30, kMostSeconds = 30;

void limitItself() {
  const rlimit memory{kMostMemory, kMostMemory}, time{kMostSeconds, kMostSeconds}, core{0, 0};
  setrlimit(RLIMIT_AS, &memory);
  setrlimit(RLIMIT_CPU, &time);
  setrlimit(RLIMIT_CORE, &core);
}

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

struct Output {
  std::string vertices, faces;
  std::uint32_t vertex_count = 0, face_count = 0;
};

void append(Output& out, const aiMesh& mesh, const aiMatrix4x4& world_from_node) {
  const std::uint32_t first = out.vertex_count;
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    const aiVector3D v = world_from_node * mesh.mVertices[i];
    for (const auto number : {v.x, v.y, v.z}) append(out.vertices, static_cast<double>(number));
  }
  out.vertex_count += mesh.mNumVertices;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (face.mNumIndices != 3) continue;
    append(out.faces, std::uint8_t{3});
    for (unsigned k = 0; k < 3; ++k) append(out.faces, first + face.mIndices[k]);
    append(out.faces, static_cast<std::uint8_t>(mesh.HasTextureCoords(0) ? 6 : 0));
    for (unsigned k = 0; mesh.HasTextureCoords(0) && k < 3; ++k) {
      const aiVector3D at = face.mIndices[k] < mesh.mNumVertices ? mesh.mTextureCoords[0][face.mIndices[k]] : aiVector3D{};
      append(out.faces, at.x);
      append(out.faces, at.y);
    }
    ++out.face_count;
  }
}

void append(Output& out, const aiScene& scene, const aiNode& node, const aiMatrix4x4& world_from_parent) {
  const aiMatrix4x4 world_from_node = world_from_parent * node.mTransformation;
  for (unsigned m = 0; m < node.mNumMeshes; ++m) append(out, *scene.mMeshes[node.mMeshes[m]], world_from_node);
  for (unsigned c = 0; c < node.mNumChildren; ++c) append(out, scene, *node.mChildren[c], world_from_node);
}

bool write(const std::string& bytes) { return std::fwrite(bytes.data(), 1, bytes.size(), stdout) == bytes.size(); }

}  // namespace

int main(int count, char** arguments) {
  limitItself();
  if (count != 2) return 2;
  try {
    Assimp::Importer importer;
    const aiScene* scene = importer.ReadFile(arguments[1], aiProcess_Triangulate);
    if (scene == nullptr || scene->mRootNode == nullptr) return 1;
    Output out;
    append(out, *scene, *scene->mRootNode, {});
    const std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(out.vertex_count) +
                               "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
                               std::to_string(out.face_count) +
                               "\nproperty list uchar uint vertex_indices\nproperty list uchar float texcoord\nend_header\n";
    return write(header) && write(out.vertices) && write(out.faces) && std::fflush(stdout) == 0 ? 0 : 1;
  } catch (...) {  // for want of memory
    return 1;
  }
}
