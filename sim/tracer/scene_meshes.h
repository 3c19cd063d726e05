// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <toftwin/result.h>

#include "sim/tracer/scene_file.h"
#include "sim/tracer/scene_loading.h"

namespace toftwin::sim {

/// Gives each object that is a mesh its triangles, each file read once: with the file's up turned to the
/// scene's, in metres, the object's scale aside. An object without a material becomes one for each surface that its
/// file tells of, and these surfaces become materials of the scene. Errors name all meshes that are wrong, one
/// a line; what people should know of the files is returned.
Result<std::vector<std::string>> readMeshes(SceneFile& file, const SceneLoading& how);

/// A material for what a mesh file says of a surface: metals are rough-metal, what is fully rough is lambertian,
/// all else is rough-dielectric. The mean of the base colour stands for the albedo at the camera's wavelength.
MaterialSpec materialOf(const meshes::Surface& surface);

/// Some of a mesh's triangles, with the vertices that they use; places on a picture only if all of them have one.
TriangleMesh partOf(const TriangleMesh& mesh, std::size_t first, std::size_t count);

/// The matrix of `up`: takes the file's coordinates to the object's.
Vec3d turnedUp(Vec3d p, Up up);

}  // namespace toftwin::sim
