// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/meshes/triangle_mesh.h"

namespace toftwin::sim {

/// A rectangle in z = 0 and a box, centred at the origin. A picture on the rectangle stands upright and is
/// not mirrored for a viewer at −z with x to the right and y down; each side of the box shows it once.
TriangleMesh rectangleMesh(double size_x, double size_y);
TriangleMesh boxMesh(double size_x, double size_y, double size_z);

}  // namespace toftwin::sim
