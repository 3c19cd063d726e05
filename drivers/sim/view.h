// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <stop_token>

#include "sim/images/light.h"
#include "sim/tracer/trace.h"

namespace toftwin::drivers::simulator {

/// What the camera sees from its pose, traced once and kept until the pose changes. Traced in bands
/// of rows, so that it can be interrupted; the bands done are kept, and the result does not depend
/// on it.
class View {
 public:
  /// `request` with everything filled in but pose and region.
  View(sim::Scene scene, sim::TraceRequest request)
      : scene_(std::move(scene)), request_(std::move(request)) {}

  [[nodiscard]] const sim::Scene& scene() const { return scene_; }
  [[nodiscard]] const Transform<World, Camera>& pose() const { return request_.world_from_camera; }
  void setPose(const Transform<World, Camera>& world_from_camera);

  /// Traces what is not traced yet. False if asked to stop before the end.
  bool complete(const std::stop_token& stop);
  /// The light of the whole image, once complete() said so.
  [[nodiscard]] const sim::Light& light() const { return light_; }

 private:
  sim::Scene scene_;
  sim::TraceRequest request_;
  sim::Light light_;
  int rows_done_ = 0;
};

}  // namespace toftwin::drivers::simulator
