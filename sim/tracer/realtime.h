// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "sim/images/light.h"
#include "sim/tracer/trace.h"

namespace toftwin::sim {

/// Light frame after frame, at a camera's own pace (docs/realtime.md).
///
/// Direct light is traced through every pixel's centre and, where depth jumps, over the pixel's
/// footprint. Light over several surfaces is gathered at every fourth pixel of every fourth row, few
/// samples a frame, kept over frames while the surface stays, smoothed along surfaces and spread to
/// all pixels. Every surface counts as diffuse there. trace() is its judge: what this mode leaves out or
/// blurs is a bias of some millimetres, what is left of noise is in Light::variance.
///
/// Not for several threads; uses all of them itself. The result depends on the requests and scenes of
/// all frames so far and on nothing else.
class RealtimeTracer {
 public:
  RealtimeTracer();
  RealtimeTracer(RealtimeTracer&&) noexcept;
  RealtimeTracer& operator=(RealtimeTracer&&) noexcept;
  ~RealtimeTracer();

  /// The next frame's light; it stays valid until the next call of next() or finish(). Of the request,
  /// `samples_per_pixel` is not used, `max_surfaces` only counts as 1 (direct light alone), 2 or any number, gates are
  /// not possible, and the region must be the whole image; otherwise throws as trace() does. The seed should stay the
  /// same. `seen` says of each phasor, in the order of Light::phasors, how the camera sees it: those unseen are left
  /// out, their images empty; of those faint there is direct light alone; folded ones are added to the first, their
  /// images empty. First harmonics are whole in any case, and without `seen` all are.
  const Light& next(const Scene& scene, const TraceRequest& request, std::span<const SeenHarmonic> seen = {});

  /// next() in two parts: begin() does what it can while the last frame's light is still read, perhaps by other
  /// threads, which is three quarters of the work (none of it with `max_surfaces` 1 or special surfaces in the scene);
  /// finish() writes the new light. Throws as next() does; finish() also if nothing was begun. What is begun and not
  /// finished leaves what it gathered, as a frame does.
  void begin(const Scene& scene, const TraceRequest& request, std::span<const SeenHarmonic> seen = {});
  /// Whether begin() does any of it.
  [[nodiscard]] static bool worksAhead(const Scene& scene, const TraceRequest& request);
  const Light& finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace toftwin::sim
