// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>

#include "sim/tracer/scene.h"
#include "sim/tracer/trace.h"

namespace toftwin::sim {

/// What of the light tracing must leave out, in words for whoever put scene and camera together; nothing if
/// it finds all. Light that a smooth surface (mirror, thin glass) throws onto another one is only met by
/// paths that run from the mirror into an emitter's disc; a point has no size to be met (docs/scene.md).
std::optional<std::string> missingLight(const Scene& scene, std::span<const EmitterSpec> emitters);

}  // namespace toftwin::sim
