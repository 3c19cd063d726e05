// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned_neighbours.h"

#include "sim/effects/phasors.h"
#include "sim/effects/squares.h"
#include "sim/images/box_mean.h"

namespace toftwin::sim {

std::string LearnedNeighbours::problem() const { return problemOfSquares(reaches_px, shares_percent); }

Light LearnedNeighbours::apply(Light light, const Conditions&, const Random&) const {
  forEachImage(light, [&]<class T>(Image<T>& image) {
    const Image<T> source = image;
    const auto add = [&](const Image<T>& mean, float share) {
      for (std::size_t i = 0; i < image.size(); ++i) image[i] += share * mean[i];
    };
    forEachSquare(source, reaches_px, shares_percent, add);
    if (row_percent != 0.0) add(boxMean(source, image.width(), 0), static_cast<float>(0.01 * row_percent));
    if (column_percent != 0.0) add(boxMean(source, 0, image.height()), static_cast<float>(0.01 * column_percent));
  });
  return light;
}

}  // namespace toftwin::sim
