// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned_neighbours.h"

#include <cmath>

#include "sim/effects/phasors.h"
#include "sim/images/box_mean.h"

namespace toftwin::sim {

std::string LearnedNeighbours::problem() const {
  if (reaches_px.size() == shares_percent.size()) return {};
  return "has " + std::to_string(shares_percent.size()) + " shares_percent for " +
         std::to_string(reaches_px.size()) + " reaches_px: one for each";
}

Light LearnedNeighbours::apply(Light light, const Conditions&, const Random&) const {
  forEachImage(light, [&]<class T>(Image<T>& image) {
    const Image<T> source = image;
    for (std::size_t k = 0; k < reaches_px.size(); ++k) {
      if (shares_percent[k] == 0.0) continue;
      const Image<T> mean = boxMean(source, static_cast<int>(std::lround(reaches_px[k])));
      const auto share = static_cast<float>(0.01 * shares_percent[k]);
      for (std::size_t i = 0; i < image.size(); ++i) image[i] += share * mean[i];
    }
  });
  return light;
}

}  // namespace toftwin::sim
