// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/lens_scatter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>
#include <vector>

#include "sim/effects/phasors.h"
#include "sim/images/simd.h"

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

/// A wide Gaussian by recursion, at the same cost for any width: out to infinity in place of four σ, and
/// its form right within 1e-3 of its peak (tested). R. Deriche 1993: for n ≥ 0
///     h(n) = Re Σᵢ Aᵢ λᵢⁿ,   λᵢ = exp((−bᵢ + j wᵢ) / σ)
/// forwards, and for n > 0 backwards: two complex one-pole filters each way.
struct Recursion {
  std::array<std::complex<float>, 2> pole, gain;

  explicit Recursion(double sigma) {
    const std::complex<double> exponent[] = {{-1.783, 0.6318}, {-1.723, 1.997}};
    const std::complex<double> amplitude[] = {{1.680, -3.735}, {-0.6803, 0.2598}};
    double sum = 0.0;  // Σ over all n of h: Re A (1 + λ) / (1 − λ)
    for (std::size_t i = 0; i < 2; ++i) {
      const std::complex<double> lambda = std::exp(exponent[i] / sigma);
      sum += (amplitude[i] * (1.0 + lambda) / (1.0 - lambda)).real();
      pole[i] = std::complex<float>{lambda};
    }
    for (std::size_t i = 0; i < 2; ++i) gain[i] = std::complex<float>{amplitude[i] / sum};
  }
};

constexpr int kLanes = 32;  ///< columns that go down together, in registers and the nearest cache

/// One step of both filters for some columns: state = pole · state + in;  out += Re(gain · before
/// or after).
TOFTWIN_SIMD void stepDown(const Recursion& filter, float* state, const float* in, float* out,
                           int lanes, bool with_itself) {
  for (std::size_t i = 0; i < 2; ++i) {
    const float pr = filter.pole[i].real(), pi = filter.pole[i].imag();
    const float gr = filter.gain[i].real(), gi = filter.gain[i].imag();
    float *real = state + 2 * i * kLanes, *imaginary = real + kLanes;
    for (int x = 0; x < lanes; ++x) {
      const float decayed_real = pr * real[x] - pi * imaginary[x];
      const float decayed_imaginary = pr * imaginary[x] + pi * real[x];
      const float now_real = decayed_real + in[x];
      // Backwards the pixel itself does not count again: what it adds is only passed on.
      out[x] += gr * (with_itself ? now_real : decayed_real) - gi * decayed_imaginary;
      real[x] = now_real;
      imaginary[x] = decayed_imaginary;
    }
  }
}

/// The filter down all columns of `height` rows of `width` floats.
std::vector<float> filteredDown(const std::vector<float>& in, int width, int height,
                                const Recursion& filter) {
  std::vector<float> out(in.size(), 0.0F);
  inParallel((width + kLanes - 1) / kLanes, 1, [&](int first, int last) {
    for (int strip = first; strip < last; ++strip) {
      const int left = strip * kLanes, lanes = std::min(kLanes, width - left);
      const auto at = [&](int y) { return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                          static_cast<std::size_t>(left); };
      std::array<float, 4 * kLanes> state{};
      for (int y = 0; y < height; ++y) stepDown(filter, state.data(), &in[at(y)], &out[at(y)], lanes, true);
      state = {};
      for (int y = height - 1; y >= 0; --y)
        stepDown(filter, state.data(), &in[at(y)], &out[at(y)], lanes, false);
    }
  });
  return out;
}

/// Rows become columns.
template <class T>
std::vector<T> transposed(const T* in, int width, int height) {
  constexpr int kBlock = 16;
  std::vector<T> out(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  forRows(width, [&](int first, int last) {
    for (int top = 0; top < height; top += kBlock) {
      for (int x = first; x < last; ++x) {
        for (int y = top; y < std::min(top + kBlock, height); ++y)
          out[static_cast<std::size_t>(x) * static_cast<std::size_t>(height) + static_cast<std::size_t>(y)] =
              in[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
      }
    }
  });
  return out;
}

/// G * image by recursion down the columns, then along the rows. Complex pixels are two columns.
template <class T>
Image<T> wideBlur(const Image<T>& image, const Recursion& filter) {
  constexpr int kParts = sizeof(T) / sizeof(float);
  const int width = image.width(), height = image.height();
  const auto* parts = reinterpret_cast<const float*>(image.pixels().data());
  std::vector<float> floats(parts, parts + image.size() * kParts);
  floats = filteredDown(floats, width * kParts, height, filter);
  const std::vector<T> turned = transposed(reinterpret_cast<const T*>(floats.data()), width, height);
  parts = reinterpret_cast<const float*>(turned.data());
  floats.assign(parts, parts + image.size() * kParts);
  floats = filteredDown(floats, height * kParts, width, filter);
  const std::vector<T> upright = transposed(reinterpret_cast<const T*>(floats.data()), height, width);
  Image<T> blurred{width, height};
  std::copy(upright.begin(), upright.end(), blurred.pixels().begin());
  return blurred;
}

constexpr double kWideFrom = 6.0;  ///< standard deviation, pixels; below, the recursion's error grows

constexpr int kCell = 4;  ///< pixels, of the coarse image that a halo is blurred on
/// From this standard deviation on the coarse image serves (tested with the rest).
constexpr double kCoarseFrom = 12.0;
/// Cells around the image: pixels at its border reach so far.
constexpr int kRing = 2;
/// What going down to cells and up again adds to the variance of a Gaussian, pixels²: cubic
/// B-splines, both times. Wherever sampled, their sum, mean and variance (a third of a cell²) are
/// exact, so that only the fourth moment depends on where in a cell light falls: of the peak 1.7e-4
/// at 12 pixels, 5e-5 at 15.
constexpr double kCellVariance = 2.0 * kCell * kCell / 3.0;

/// The four cells from `first` on, counted with the ring, that a pixel's light goes to or comes
/// from.
struct Knots {
  int first;
  std::array<float, 4> weight;
};

Knots knotsOf(int pixel) {
  const double place = (pixel + 0.5) / kCell - 0.5 + kRing, t = place - std::floor(place),
               s = 1.0 - t;
  return {static_cast<int>(std::floor(place)) - 1,
          {static_cast<float>(s * s * s / 6.0),
           static_cast<float>((4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0),
           static_cast<float>((4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0),
           static_cast<float>(t * t * t / 6.0)}};
}

std::vector<Knots> knotsOfAll(int pixels) {
  std::vector<Knots> knots;
  for (int i = 0; i < pixels; ++i) knots.push_back(knotsOf(i));
  return knots;
}

int cellsAlong(int pixels) { return (pixels + kCell - 1) / kCell + 2 * kRing; }

TOFTWIN_SIMD void addScaled(const float* __restrict in, float weight, int count,
                            float* __restrict sum) {
  for (int i = 0; i < count; ++i) sum[i] += weight * in[i];
}

TOFTWIN_SIMD void mixFour(const float* const* rows, const std::array<float, 4>& weight, int count,
                          float* __restrict out) {
  const float *a = rows[0], *b = rows[1], *c = rows[2], *d = rows[3];
  for (int i = 0; i < count; ++i)
    out[i] = weight[0] * a[i] + weight[1] * b[i] + weight[2] * c[i] + weight[3] * d[i];
}

/// out = kept · out + veil + spread · halo, complex numbers as two floats; the veil as well.
TOFTWIN_SIMD void compose(const float* __restrict halo, float kept, float veil_even, float veil_odd,
                          float spread, int pairs, float* __restrict out) {
  for (int i = 0; i < pairs; ++i) {
    out[2 * i] = kept * out[2 * i] + (veil_even + spread * halo[2 * i]);
    out[2 * i + 1] = kept * out[2 * i + 1] + (veil_odd + spread * halo[2 * i + 1]);
  }
}

template <class T>
const float* floatsOf(const T* values) {
  return reinterpret_cast<const float*>(values);  // a complex number is an array of two
}
template <class T>
float* floatsOf(T* values) {
  return reinterpret_cast<float*>(values);
}

/// Mean light of cells and of a dark ring around, into which light is scattered too.
template <class T>
Image<T> cellsOf(const Image<T>& image, const std::vector<Knots>& columns,
                 const std::vector<Knots>& rows) {
  constexpr int kParts = sizeof(T) / sizeof(float);
  const int width = image.width();
  Image<T> cells{cellsAlong(width), cellsAlong(image.height())};
  inParallel(cells.height(), 4, [&](int first, int last) {
    std::vector<T> sum(static_cast<std::size_t>(width));
    for (int v = first; v < last; ++v) {
      std::fill(sum.begin(), sum.end(), T{});
      const int from = kCell * (v - kRing - 2), to = kCell * (v - kRing + 3);
      for (int y = std::max(0, from); y < std::min(to, image.height()); ++y) {
        const Knots& row = rows[static_cast<std::size_t>(y)];
        if (v < row.first || v > row.first + 3) continue;
        addScaled(floatsOf(&image(0, y)), row.weight[static_cast<std::size_t>(v - row.first)],
                  width * kParts, floatsOf(sum.data()));
      }
      T* out = &cells(0, v);
      for (std::size_t x = 0; x < sum.size(); ++x) {
        T* near = out + columns[x].first;
        for (std::size_t i = 0; i < 4; ++i) near[i] += columns[x].weight[i] * sum[x];
      }
      for (int u = 0; u < cells.width(); ++u) out[u] *= 1.0F / (kCell * kCell);
    }
  });
  return cells;
}

/// Rows of cells with as many columns as the image has.
template <class T>
Image<T> widened(const Image<T>& cells, const std::vector<Knots>& columns) {
  Image<T> wide{static_cast<int>(columns.size()), cells.height()};
  inParallel(cells.height(), 4, [&](int first, int last) {
    for (int v = first; v < last; ++v) {
      T* out = &wide(0, v);
      for (std::size_t x = 0; x < columns.size(); ++x) {
        const T* in = &cells(columns[x].first, v);
        const auto& [a, b, c, d] = columns[x].weight;
        out[x] = a * in[0] + b * in[1] + c * in[2] + d * in[3];
      }
    }
  });
  return wide;
}

/// image = kept · image + veil + spread · halo, the halo on coarse cells.
template <class T>
void addCoarseHalo(Image<T>& image, float kept, T veil, float spread, double sigma) {
  constexpr int kParts = sizeof(T) / sizeof(float);
  const std::vector<Knots> columns = knotsOfAll(image.width()), rows = knotsOfAll(image.height());
  const Image<T> cells = widened(
      blur(cellsOf(image, columns, rows), halfGaussian(std::sqrt(sigma * sigma - kCellVariance) / kCell)), columns);
  const float even = floatsOf(&veil)[0], odd = floatsOf(&veil)[kParts - 1];
  forRows(image.height(), [&](int first_row, int last_row) {
    const int count = image.width() * kParts;
    std::vector<float> halo(static_cast<std::size_t>(count) + 1);
    for (int y = first_row; y < last_row; ++y) {
      const Knots& row = rows[static_cast<std::size_t>(y)];
      const float* four[4];
      for (int i = 0; i < 4; ++i) four[i] = floatsOf(&cells(0, row.first + i));
      mixFour(four, row.weight, count, halo.data());
      float* out = floatsOf(&image(0, y));
      compose(halo.data(), kept, even, odd, spread, count / 2, out);
      if (count % 2 != 0) out[count - 1] = kept * out[count - 1] + (even + spread * halo[halo.size() - 2]);
    }
  });
}

template <class T, class Sum>
void scatter(Image<T>& image, const LensScatter& lens, Sum sum) {
  if (lens.veil > 0.0) {
    for (const T& value : image.pixels()) sum += value;
  }
  const auto veil = static_cast<T>(
      sum * (lens.veil / static_cast<double>(std::max<std::size_t>(image.size(), 1))));
  const auto kept = static_cast<float>(1.0 - lens.veil - lens.halo);
  const auto spread = static_cast<float>(lens.halo);
  if (lens.halo > 0.0 && lens.halo_radius >= kCoarseFrom) {
    addCoarseHalo(image, kept, veil, spread, lens.halo_radius);
    return;
  }
  Image<T> halo;
  if (lens.halo > 0.0) {
    halo = lens.halo_radius < kWideFrom ? blur(image, halfGaussian(lens.halo_radius))
                                        : wideBlur(image, Recursion{lens.halo_radius});
  }
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
  forEachImage(light, [&]<class T>(Image<T>& image) {
    if constexpr (std::is_same_v<T, float>) {
      scatter(image, *this, 0.0);
    } else {
      scatter(image, *this, std::complex<double>{});
    }
  });
  return light;
}

}  // namespace toftwin::sim
