// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <toftwin/camera_info.h>
#include <toftwin/geometry.h>

#include "sim/tracer/lanes.h"

namespace toftwin::sim {

/// The rays of sixteen pixels' footprints: the central ray exactly, the others by the derivative of the
/// inverse distortion. Error: half the second derivative times the squared offset; half a pixel from
/// the centre below 1e-6 rad in most of a Kinect's image, 4e-6 rad in its last corner.
struct PixelRays {
  Lanes<double> x, y;  ///< of the central ray on the plane z = 1
  Lanes<double> x_by_u, x_by_v, y_by_u, y_by_v;

  /// Unit direction in the camera's frame at (du, dv) pixels from the centre of a lane's pixel.
  [[nodiscard]] Vec3d direction(std::size_t lane, double du, double dv) const {
    return normalised(Vec3d{x[lane] + x_by_u[lane] * du + x_by_v[lane] * dv, y[lane] + y_by_u[lane] * du + y_by_v[lane] * dv, 1.0});
  }
};

/// A camera's lens, ready to invert its distortion.
class Lens {
 public:
  explicit Lens(const CameraInfo& camera);

  /// The rays of the pixels (u, v).
  void raysOf(const Lanes<int>& u, const Lanes<int>& v, PixelRays& rays) const;

  static constexpr int kStartTerms = 8;
  struct Start {
    std::array<double, kStartTerms> terms;
    double end;
  };

 private:
  CameraInfo camera_;
  Start start_;
};

}  // namespace toftwin::sim
