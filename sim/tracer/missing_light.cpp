// SPDX-License-Identifier: Apache-2.0
#include "sim/tracer/missing_light.h"

#include <algorithm>
#include <variant>

#include "sim/tracer/mirrored_light.h"
#include "sim/tracer/scene_impl.h"

namespace toftwin::sim {
namespace {

bool isGlass(const bsdf::Any& model) { return std::holds_alternative<bsdf::ThinGlass>(model); }
bool isAMirror(const bsdf::Any& model) { return std::holds_alternative<bsdf::Mirror>(model); }

/// Whether there is more than one mirror, flat or not: light may come over two.
bool hasSeveralMirrors(const Scene::Impl& scene) {
  const auto planes = mirrorPlanes(scene);
  return std::ranges::any_of(planes, [&](const MirrorPlane& plane) { return plane.object != planes.front().object; });
}

}  // namespace

std::optional<std::string> missingLight(const Scene& scene, std::span<const EmitterSpec> emitters, bool in_real_time) {
  const auto& models = scene.impl().models;
  const bool has_glass = std::ranges::any_of(models, isGlass), has_mirror = std::ranges::any_of(models, isAMirror);
  if (in_real_time && (has_glass || has_mirror))
    return "in real time the light that a mirror or thin glass throws onto other surfaces is missing; mode = "
           "\"unbiased\" looks for it";
  const bool has_point =
      std::ranges::any_of(emitters, [](const EmitterSpec& emitter) { return !(emitter.radius > Length{}); });
  if (!has_point) return std::nullopt;
  if (has_glass || !areAllMirrorsFlat(scene.impl()))
    return "the scene has a curved mirror or thin glass and the camera an emitter that is a point: the light that the "
           "one throws onto other surfaces is missing, for no path meets a point. Give each [[emitter]] of the camera "
           "file a radius_mm; the smaller, the noisier that light is";
  if (hasSeveralMirrors(scene.impl()))
    return "the scene has several mirrors and the camera an emitter that is a point: light over two of them onto "
           "another surface is missing, for no path meets a point. Give each [[emitter]] of the camera file a "
           "radius_mm; the smaller, the noisier that light is";
  return std::nullopt;
}

}  // namespace toftwin::sim
