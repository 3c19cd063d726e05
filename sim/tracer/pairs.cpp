// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/pairs.h"

namespace toftwin::sim {
namespace {

constexpr std::size_t kLeast = 1000;  // triangles

}  // namespace

bool areInPairs(const std::vector<Vec3d>& vertices, const std::vector<Triangle>& triangles) {
  if (triangles.size() < kLeast || triangles.size() % 2 != 0) return false;
  for (std::size_t i = 0; i < triangles.size(); i += 2) {
    const Triangle &one = triangles[i], &other = triangles[i + 1];
    if (vertices[one[0]] != vertices[other[0]] || vertices[one[2]] != vertices[other[1]]) return false;
  }
  return true;
}

std::vector<std::array<std::uint32_t, 4>> quadranglesOf(const std::vector<Triangle>& triangles) {
  std::vector<std::array<std::uint32_t, 4>> quadrangles;
  quadrangles.reserve(triangles.size() / 2);
  for (std::size_t i = 0; i < triangles.size(); i += 2) {
    const auto& [a, b, c] = triangles[i];
    quadrangles.push_back({b, c, triangles[i + 1][2], a});
  }
  return quadrangles;
}

}  // namespace toftwin::sim
