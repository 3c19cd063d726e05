// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stop_token>
#include <string>

#include "sim/meshes/mesh_file.h"

namespace toftwin::sim::meshes::testing {

/// A folder of mesh files that a test writes and reads.
class MeshFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = ::testing::TempDir() + "meshesXXXXXX";
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream{folder_ / name, std::ios::binary} << bytes;
    return folder_ / name;
  }
  [[nodiscard]] Result<MeshFile> read(const std::string& name, const std::string& bytes) const {
    return readMeshFile(write(name, bytes));
  }
  [[nodiscard]] std::string errorOf(const std::string& name, const std::string& bytes) const {
    const auto mesh = read(name, bytes);
    return mesh ? "no error" : mesh.error().message;
  }

  std::filesystem::path folder_;
};

/// A token that has asked already. (On the heap, because GCC 12 takes one on the stack for uninitialised.)
inline std::stop_token stoppedToken() {
  const auto source = std::make_unique<std::stop_source>();
  source->request_stop();
  return source->get_token();
}

inline double areaOf(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.triangles)
    area += norm(cross(mesh.vertices[b] - mesh.vertices[a], mesh.vertices[c] - mesh.vertices[a])) / 2.0;
  return area;
}

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace toftwin::sim::meshes::testing
