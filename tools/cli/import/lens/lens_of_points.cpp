// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/import/lens/lens_of_points.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "drivers/ray_fit.h"

namespace toftwin::cli {

Result<FoundLens> lensOfPoints(int width, int height, std::span<const float> points) {
  constexpr std::size_t kFewest = 100;
  std::vector<float> rays(points.begin(), points.end());
  std::size_t valid = 0;
  for (std::size_t i = 0; i + 2 < rays.size(); i += 3) {
    const bool is_ray = std::isfinite(rays[i]) && std::isfinite(rays[i + 1]) && std::isfinite(rays[i + 2]) && rays[i + 2] > 0.0f;
    if (is_ray) ++valid;
    else rays[i] = rays[i + 1] = rays[i + 2] = 0.0f;
  }
  if (valid < kFewest) return Error{Error::Code::InvalidArgument, fmt::format("its first cloud has {} points, of which no lens can be found; --lens says it", valid)};
  const auto fitted = drivers::fitCamera(width, height, rays);
  if (!fitted) return Error{fitted.error().code, "no lens puts its points at their pixels: are x, y and z right, down and forward of the camera? " + fitted.error().message};
  return FoundLens{fitted->camera, fmt::format("the lens is that which puts the points of the first cloud at their pixels: f = {:.4g}, {:.4g} px, to {:.3f} px (RMS)",
                                               fitted->camera.fx, fitted->camera.fy, fitted->rms_px)};
}

}  // namespace toftwin::cli
