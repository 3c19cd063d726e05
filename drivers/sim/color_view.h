// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <stop_token>

#include <toftwin/frame.h>

#include "sim/sensor/color.h"

namespace toftwin::drivers::simulator {

/// What the camera's colour lens sees, traced once and kept until the pose or, where things move, the frame is
/// another. Can be interrupted; then it is begun anew.
class ColorView {
 public:
  /// `request` with everything filled in but the pose.
  ColorView(sim::VisibleScene scene, sim::ColorRequest request)
      : scene_(std::move(scene)), request_(std::move(request)) {}

  /// Traces what is seen at a time since device time 0, if it is not kept from the same pose and `number`, which also
  /// makes its noise independent of that of others. False if asked to stop before the end.
  bool complete(const Transform<World, Camera>& pose, Duration time, std::uint64_t number,
                const std::stop_token& stop);
  /// As it lies over a range image of the depth lens; complete() must have said true.
  [[nodiscard]] Plane over(const sim::DecodeRays& rays, const Image<float>& range_m) const;

 private:
  sim::VisibleScene scene_;
  sim::ColorRequest request_;
  std::uint64_t seed_ = request_.seed;
  std::uint64_t number_ = 0;
  std::optional<sim::ColorImage> color_;  ///< of the request's pose and the number
};

}  // namespace toftwin::drivers::simulator
