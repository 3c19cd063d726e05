// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/defocus.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/effects/phasors.h"

namespace toftwin::sim {
namespace {

/// One place of the kernel: (dx, dy) pixels away, and its share of the light.
struct Share {
  int dx, dy;
  float weight;
};

/// The spot's light in each pixel, point by point of the disc: each point's Gaussian is integrated over
/// the pixel, the product of two differences of erf. Without a Gaussian the points are counted.
std::vector<Share> spotOf(const Defocus& lens) {
  constexpr int kPoints = 24;  // across the disc
  const int reach = static_cast<int>(std::ceil(lens.radius + 4.0 * lens.sigma));
  const int side = 2 * reach + 1;
  std::vector<double> light(static_cast<std::size_t>(side * side), 0.0);
  const auto within = [&](double from, int pixel) {  // share of a point's light along one axis
    const double low = pixel - 0.5 - from, high = pixel + 0.5 - from;
    if (lens.sigma == 0.0) return low <= 0.0 && high > 0.0 ? 1.0 : 0.0;
    const double scale = 1.0 / (lens.sigma * std::sqrt(2.0));
    return 0.5 * (std::erf(high * scale) - std::erf(low * scale));
  };
  const int points = lens.radius > 0.0 ? kPoints : 1;
  for (int j = 0; j < points; ++j) {
    for (int i = 0; i < points; ++i) {
      const double px = ((i + 0.5) / points * 2.0 - 1.0) * lens.radius;
      const double py = ((j + 0.5) / points * 2.0 - 1.0) * lens.radius;
      if (px * px + py * py > lens.radius * lens.radius) continue;
      std::vector<double> across;
      for (int x = -reach; x <= reach; ++x) across.push_back(within(px, x));
      for (std::size_t y = 0; y < across.size(); ++y) {
        const double along = within(py, static_cast<int>(y) - reach);
        for (std::size_t x = 0; x < across.size(); ++x)
          light[y * across.size() + x] += along * across[x];
      }
    }
  }
  double sum = 0.0;
  for (double value : light) sum += value;
  std::vector<Share> spot;
  for (int i = 0; i < side * side; ++i) {
    const double weight = light[static_cast<std::size_t>(i)] / sum;
    if (weight > 1e-7) spot.push_back({i % side - reach, i / side - reach, static_cast<float>(weight)});
  }
  return spot;
}

template <class T>
void convolve(Image<T>& image, const std::vector<Share>& spot, int reach) {
  const Image<T> source = image;
  const int width = image.width(), height = image.height();
  forRows(height, [&](int first_row, int last_row) {
    std::vector<T> padded(static_cast<std::size_t>(width + 2 * reach));
    for (int y = first_row; y < last_row; ++y) {
      T* out = &image(0, y);
      std::fill_n(out, width, T{});
      int row = -1;
      for (const Share& share : spot) {  // row by row: the spot is in that order
        const int from = std::clamp(y + share.dy, 0, height - 1);
        if (from != row) {
          row = from;
          const T* in = &source(0, from);
          std::fill_n(padded.begin(), reach, in[0]);
          std::copy_n(in, width, padded.begin() + reach);
          std::fill_n(padded.begin() + reach + width, reach, in[width - 1]);
        }
        const T* in = padded.data() + reach + share.dx;
        for (int x = 0; x < width; ++x) out[x] += share.weight * in[x];
      }
    }
  });
}

}  // namespace

Light Defocus::apply(Light light, const Conditions&, const Random&) const {
  if ((radius == 0.0 && sigma == 0.0) || light.steady.empty()) return light;
  const std::vector<Share> spot = spotOf(*this);
  const int reach = static_cast<int>(std::ceil(radius + 4.0 * sigma));
  forEachImage(light, [&](auto& image) { convolve(image, spot, reach); });
  return light;
}

}  // namespace toftwin::sim
