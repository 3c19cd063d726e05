// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/missing_light.h"

#include <algorithm>
#include <variant>

#include "sim/tracer/mirrored_light.h"
#include "sim/tracer/scene_impl.h"

namespace toftwin::sim {
namespace {

bool isGlass(const bsdf::Any& model) { return std::holds_alternative<bsdf::ThinGlass>(model); }

}  // namespace

std::optional<std::string> missingLight(const Scene& scene, std::span<const EmitterSpec> emitters) {
  const bool has_point =
      std::ranges::any_of(emitters, [](const EmitterSpec& emitter) { return !(emitter.radius > Length{}); });
  const bool is_found = areAllMirrorsFlat(scene.impl()) && std::ranges::none_of(scene.impl().models, isGlass);
  if (!has_point || is_found) return std::nullopt;
  return "the scene has a curved mirror or thin glass and the camera an emitter that is a point: the light "
         "that the "
         "one throws "
         "onto other surfaces is missing, for no path meets a point. Give each [[emitter]] of the camera "
         "file a "
         "radius_mm; the smaller, the noisier that light is";
}

}  // namespace toftwin::sim
