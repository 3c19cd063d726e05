// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <variant>

#include "sim/tracer/bsdf/diffuse.h"
#include "sim/tracer/bsdf/microfacet.h"
#include "sim/tracer/bsdf/mirror.h"
#include "sim/tracer/bsdf/retroreflector.h"
#include "sim/tracer/bsdf/translucent.h"

namespace toftwin::sim::bsdf {

/// Every reflection model. Adding one: its file, its place here, its keys in scene_file.h.
using Any =
    std::variant<Diffuse, RoughDielectric, RoughMetal, Mirror, Retroreflector, Translucent, ThinGlass>;

}  // namespace toftwin::sim::bsdf
