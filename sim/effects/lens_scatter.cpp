// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/lens_scatter.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/images/rows.h"

namespace toftwin::sim {
namespace {

/// One half of a sampled Gaussian that sums to one, out to four standard deviations.
std::vector<float> halfGaussian(double sigma) {
  const auto reach = static_cast<std::size_t>(std::ceil(4.0 * sigma));
  std::vector<float> half(reach + 1);
  double sum = 0.0;
  for (std::size_t i = 0; i <= reach; ++i) {
    const double value = std::exp(-0.5 * static_cast<double>(i * i) / (sigma * sigma));
    half[i] = static_cast<float>(value);
    sum += i == 0 ? value : 2.0 * value;
  }
  for (float& value : half) value /= static_cast<float>(sum);
  return half;
}

/// G * image, dark outside the image. Rows first, then columns, row by row so that memory is read
/// in order.
template <class T>
Image<T> blur(const Image<T>& image, const std::vector<float>& half) {
  const int width = image.width(), height = image.height();
  const int reach = static_cast<int>(half.size()) - 1;
  Image<T> along_rows{width, height}, result{width, height};
  forRows(height, [&](int first_row, int last_row) {
    std::vector<T> padded(static_cast<std::size_t>(width + 2 * reach));
    for (int y = first_row; y < last_row; ++y) {
      std::copy_n(&image(0, y), width, padded.begin() + reach);
      T* out = &along_rows(0, y);
      for (int i = -reach; i <= reach; ++i) {
        const float weight = half[static_cast<std::size_t>(std::abs(i))];
        const T* in = padded.data() + reach + i;
        for (int x = 0; x < width; ++x) out[x] += weight * in[x];
      }
    }
  });
  forRows(height, [&](int first_row, int last_row) {
    for (int y = first_row; y < last_row; ++y) {
      T* out = &result(0, y);
      for (int from = std::max(0, y - reach); from <= std::min(height - 1, y + reach); ++from) {
        const float weight = half[static_cast<std::size_t>(std::abs(from - y))];
        const T* in = &along_rows(0, from);
        for (int x = 0; x < width; ++x) out[x] += weight * in[x];
      }
    }
  });
  return result;
}

template <class T, class Sum>
void scatter(Image<T>& image, const LensScatter& lens, const std::vector<float>& half, Sum sum) {
  for (const T& value : image.pixels()) sum += value;
  const auto veil = static_cast<T>(
      sum * (lens.veil / static_cast<double>(std::max<std::size_t>(image.size(), 1))));
  const auto kept = static_cast<float>(1.0 - lens.veil - lens.halo);
  const auto spread = static_cast<float>(lens.halo);
  const Image<T> halo = lens.halo > 0.0 ? blur(image, half) : Image<T>{};
  for (std::size_t i = 0; i < image.size(); ++i) {
    image[i] = kept * image[i] + veil;
    if (!halo.empty()) image[i] += spread * halo[i];
  }
}

}  // namespace

std::string LensScatter::problem() const {
  return veil + halo < 1.0 ? "" : "scatters all light: veil and halo together must be less than 1";
}

Light LensScatter::apply(Light light, const Conditions&, const Random&) const {
  if (veil == 0.0 && halo == 0.0) return light;
  const std::vector<float> half = halfGaussian(halo_radius);
  for (auto& phasor : light.phasors) scatter(phasor, *this, half, std::complex<double>{});
  scatter(light.steady, *this, half, 0.0);
  scatter(light.ambient, *this, half, 0.0);
  return light;
}

}  // namespace toftwin::sim
