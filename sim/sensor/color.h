// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <functional>

#include <toftwin/result.h>

#include "sim/sensor/registration.h"
#include "sim/tracer/scene.h"
#include "sim/tracer/trace.h"

namespace toftwin::sim {

/// The scene in the three bands of a colour camera: materials with their colours instead of their
/// infrared albedo. Lamps and surroundings shine in them as they do in the infrared.
using VisibleScene = std::array<Scene, 3>;
Result<VisibleScene> loadVisible(const std::filesystem::path& scene_file, const SceneLoading& how = {});
Result<VisibleScene> parseVisible(std::string_view toml, const std::filesystem::path& name);

/// Traces one band of an image: the whole request, or in bands of rows with progress shown.
using TraceBand = std::function<Result<Light>(const Scene& scene, const TraceRequest& request)>;

/// What a colour camera at `world_from_camera` (the depth lens's pose) sees. It exposes by itself,
/// so that 99 % of the pixels are below white. Light: the scene's lamps and surroundings; where it
/// has none, a lamp 0.3 m above the lens. No noise.
struct ColorRequest {
  LensPair lenses;
  Transform<World, Camera> world_from_camera;
  int samples_per_pixel = 16;
  int max_surfaces = 4;
  std::uint64_t seed = 1;
};
Result<ColorImage> renderColor(const VisibleScene& scene, const ColorRequest& request,
                               const TraceBand& trace_band);

/// The image at another size: the lens of `share` as many pixels on each side.
CameraInfo scaled(const CameraInfo& camera, double share);

}  // namespace toftwin::sim
