// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <toftwin/camera_info.h>
#include <toftwin/geometry.h>
#include <toftwin/units.h>

#include "sim/images/light.h"
#include "sim/tracer/scene.h"
#include "sim/tracer/scene_file.h"

namespace toftwin::sim {

/// A light source that moves with the camera. A disc of `radius` (0: a point) at `position` in the
/// camera frame, facing `axis`. Radiant intensity at angle γ from the axis:
///   I(γ) = power_w · (m + 1) / 2π · cos^m γ   inside the cone of `half_angle`, 0 outside   [W/sr]
/// (the power is that of the uncut lobe over the half space); `isotropic` instead radiates
/// power_w / 4π everywhere.
struct EmitterSpec {
  Vec3d position_m{};
  Vec3d axis{0.0, 0.0, 1.0};
  Length radius{};
  double power_w = 1.0;
  double lobe_exponent = 1.0;  ///< m
  Angle half_angle = 90.0 * degree;
  bool isotropic = false;
  /// A radiation pattern instead of the lobe: relative intensities at these angles from the axis, ascending from
  /// 0, at least two; linear between, dark beyond the last. The power is that of the whole pattern.
  std::vector<double> pattern_deg{}, pattern{};
  Duration delay{};  ///< its light is late by this: cables, drivers

  bool operator==(const EmitterSpec&) const = default;
};

/// Two functions of the light's whole way, as pulsed cameras need them: what a gate collects of a pulse that
/// took this way. Linear between the knots at 0, `step`, 2 `step`, …; zero beyond the last.
struct PathFunctions {
  Length step = 1 * millimetre;
  std::vector<float> first, second;  ///< of equal length
};

/// How the paths of a pixel are drawn; all three have the same mean (docs/tracer.md).
enum class Sampler {
  Plain,   ///< every random number by itself: what the others are measured against
  Even,    ///< a pixel's samples are spread evenly over its footprint, emitters and the first two bounces
  Shared,  ///< the same over tiles of 8 × 8 pixels, which use each other's paths
};

/// What to trace. The result depends on nothing else, not on the number of threads.
struct TraceRequest {
  CameraInfo camera;
  Transform<World, Camera> world_from_camera;
  std::vector<EmitterSpec> emitters;
  std::vector<Frequency> frequencies;
  int harmonics = 1;
  std::vector<PathFunctions> gates;  ///< instead of frequencies (Light::phasors)
  int samples_per_pixel = 16;  ///< Shared: up to nine times as many in tiles whose light is uneven
  /// Positive: only as many samples as leave this noise of the range at the highest frequency, as the root mean
  /// square over a tile of 8 × 8 pixels (Shared) or of the pixel; `samples_per_pixel` is then the most.
  Length wanted_noise{};
  int max_surfaces = 16;       ///< surface hits per path: 1 = direct light only
  double pixel_extent = 1.0;   ///< side of the pixel's footprint in pixels; 0: its central ray only
  Sampler sampler = Sampler::Even;
  std::uint64_t seed = 0;
  /// Only these pixels are traced; the images have this size. Width 0: all.
  int region_x = 0, region_y = 0, region_width = 0, region_height = 0;
};

/// Path-traces the scene: unidirectional, next-event estimation to every emitter, cosine- or
/// BSDF-sampled bounces, one pass for all frequencies and harmonics or gates. `recycled` may be an earlier frame's
/// light, whose memory is then used again.
Light trace(const Scene& scene, const TraceRequest& request, Light recycled = {});

}  // namespace toftwin::sim
