// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/nan.h>

namespace toftwin::daemon::modbus {

/// What the registers tell of a frame.
struct FrameFacts {
  double valid = 0.0, centre_m = kNaN, nearest_m = kNaN;  ///< valid: a share; ranges along the ray
  double illumination_c = kNaN, sensor_c = kNaN, housing_c = kNaN, room_c = kNaN;
  double powered_on_s = 0.0;
  std::int64_t device_ns = 0;
  std::chrono::steady_clock::time_point came;
};

/// Makes facts of one frame after the other.
class FrameWatch {
 public:
  /// Of a frame that has depth alone: range = depth / z of the pixel's ray.
  FrameFacts factsOf(const Frame& frame);

 private:
  /// Along the ray, metres; NaN where there is none. Nothing if the frame has neither range nor depth.
  std::vector<float> rangesOf(const Frame& frame);

  struct Rays {
    CameraInfo camera;
    std::vector<float> unit_vectors;
  };
  std::optional<Rays> rays_;  ///< of the last frame that needed them
};

}  // namespace toftwin::daemon::modbus
