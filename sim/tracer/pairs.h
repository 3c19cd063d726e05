// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sim/tracer/lanes.h"

namespace toftwin::sim {

/// Meshes are mostly made of quadrangles, each cut into two triangles that follow each other, (a, b, c) and (a, c, d). As
/// quadrangles (b, c, d, a) Embree has half as many things to look at, in half the memory: it cuts them in the same way, and with
/// its robust test a ray still meets one of the two triangles along each edge.
using Triangle = std::array<std::uint32_t, 3>;

/// Whether all of a mesh is so, and it is large enough for that to matter. Places count, not which vertices are at them:
/// some files have corners of their own for each triangle.
bool areInPairs(const std::vector<Vec3d>& vertices, const std::vector<Triangle>& triangles);

/// The quadrangles of such a mesh, as Embree takes their corners.
std::vector<std::array<std::uint32_t, 4>> quadranglesOf(const std::vector<Triangle>& triangles);

/// What Embree met of a quadrangle, as what it would say of the triangle: its number, and u and v there. Embree gives u and v of
/// (b, c, a) up to their diagonal, u + v = 1, and beyond it 1 - u and 1 - v of (d, a, c).
TOFTWIN_INLINE void takeApart(bool is_paired, unsigned& primitive, float& u, float& v) {
  const bool is_second = u + v > 1.0f;
  const unsigned triangle = 2 * primitive + (is_second ? 1 : 0);
  const float of_b = 1.0f - u - v, of_c = is_second ? 1.0f - v : u;
  primitive = is_paired ? triangle : primitive;
  // Of (a, b, c) u and v are the shares of b and c, of (a, c, d) those of c and d.
  const float first = is_second ? of_c : of_b, second = is_second ? -of_b : of_c;
  u = is_paired ? first : u;
  v = is_paired ? second : v;
}

}  // namespace toftwin::sim
