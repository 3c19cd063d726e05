// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/mesh.h"

namespace toftwin::sim {

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
