// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/vignetting.h"

#include <cmath>

#include "sim/effects/phasors.h"

namespace toftwin::sim {

Light Vignetting::apply(Light light, const Conditions& now, const Random&) const {
  if (exponent == 0.0) return light;
  Image<float> passed{light.width(), light.height()};
  forRows(light.height(), [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      const double up = (now.top + y - now.camera.cy) / now.camera.fy;
      for (int x = 0; x < light.width(); ++x) {
        const double across = (now.left + x - now.camera.cx) / now.camera.fx;
        passed(x, y) =
            static_cast<float>(std::pow(1.0 + across * across + up * up, -0.5 * exponent));
      }
    }
  });
  forEachImage(light, [&](auto& image) {
    for (std::size_t i = 0; i < image.size(); ++i) image[i] *= passed[i];
  });
  return light;
}

}  // namespace toftwin::sim
