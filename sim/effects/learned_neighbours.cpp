// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/learned_neighbours.h"

#include "sim/effects/phasors.h"
#include "sim/effects/squares.h"

namespace toftwin::sim {

std::string LearnedNeighbours::problem() const { return problemOfSquares(reaches_px, shares_percent); }

Light LearnedNeighbours::apply(Light light, const Conditions&, const Random&) const {
  forEachImage(light, [&]<class T>(Image<T>& image) {
    const Image<T> source = image;
    forEachSquare(source, reaches_px, shares_percent, [&](const Image<T>& mean, float share) {
      for (std::size_t i = 0; i < image.size(); ++i) image[i] += share * mean[i];
    });
  });
  return light;
}

}  // namespace toftwin::sim
