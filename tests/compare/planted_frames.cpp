// SPDX-License-Identifier: Apache-2.0
// Repeated frames whose noise is alike along a row and from frame to frame.
#include <cmath>

#include "planted.h"

namespace toftwin::compare {
namespace {

/// Frames of 32 × 32 pixels: fixed pattern of 3 mm, noise of 5 mm that is alike along x (0.4) and from frame to frame; and what all of
/// a frame is off by besides.
Traits noisyFrames(Noise& noise, int count, double in_time, double shared = 0.0) {
  constexpr int kSize = 32;
  const auto along = [&](std::vector<double> row) {
    for (std::size_t i = 1; i < row.size(); ++i) row[i] = 0.4 * row[i - 1] + std::sqrt(1.0 - 0.16) * row[i];
    return row;
  };
  Image<float> fixed(kSize, kSize);
  for (float& one : fixed.pixels()) one = static_cast<float>(noise(3.0));
  Image<double> last(kSize, kSize);
  std::vector<Image<float>> frames;
  for (int f = 0; f < count; ++f) {
    Image<float>& frame = frames.emplace_back(kSize, kSize);
    const double of_frame = shared > 0.0 ? noise(shared) : 0.0;
    for (int y = 0; y < kSize; ++y) {
      std::vector<double> row;
      for (int x = 0; x < kSize; ++x) row.push_back(noise(5.0));
      row = along(std::move(row));
      for (int x = 0; x < kSize; ++x) {
        const double fresh = row[static_cast<std::size_t>(x)];
        last(x, y) = f == 0 ? fresh : in_time * last(x, y) + std::sqrt(1.0 - in_time * in_time) * fresh;
        frame(x, y) = static_cast<float>(2000.0 + static_cast<double>(fixed(x, y)) + last(x, y) + of_frame);
      }
    }
  }
  return noiseTraits(frames);
}

}  // namespace

std::vector<Planted> plantedFrames() {
  return {{"noise of frames",
           {{"temporal noise", 5.0},
            {"fixed pattern", 3.0},
            {"correlation along x", 0.4},
            {"correlation along y", 0.0},
            {"correlation in time", 0.3}},
           [](Noise& noise) { return noisyFrames(noise, 40, 0.3); }},
          {"noise of twelve frames that go with each other",
           {{"temporal noise", 5.0}, {"fixed pattern", 3.0}, {"correlation in time", 0.7}},
           [](Noise& noise) { return noisyFrames(noise, 12, 0.7); }},
          {"noise of ten frames, 2 mm of which all pixels share",
           {{"temporal noise", std::sqrt(29.0)}, {"fixed pattern", 3.0}},
           [](Noise& noise) { return noisyFrames(noise, 10, 0.0, 2.0); }}};
}

}  // namespace toftwin::compare
