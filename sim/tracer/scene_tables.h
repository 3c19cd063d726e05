// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocol/settings/settings.h"
#include "sim/tracer/scene_file.h"

/// Tables that a scene file shares with the file beside a world (world_scene.h).
namespace toftwin::sim {

/// A [[material]], checked but for its name, and the picture that it names.
MaterialSpec readMaterial(settings::Table& table, NamedFile& texture);
/// [ambient] and [[foreign_emitter]] of a file.
void readLight(settings::Table& root, SceneFile& file);

}  // namespace toftwin::sim
