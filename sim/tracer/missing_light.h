// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>

#include "sim/tracer/scene.h"
#include "sim/tracer/trace.h"

namespace toftwin::sim {

/// What of the light tracing must leave out, in words for whoever put scene and camera together; nothing if
/// it finds all. What a point throws onto a surface over one flat mirror is found; over two mirrors, a curved one or
/// the reflection of a pane it would only be met by paths that run into the emitter, and a point has no size to be
/// met (docs/scene.md). In real time nothing is found that comes over a mirror or the reflection of a pane.
std::optional<std::string> missingLight(const Scene& scene, std::span<const EmitterSpec> emitters, bool in_real_time);

}  // namespace toftwin::sim
