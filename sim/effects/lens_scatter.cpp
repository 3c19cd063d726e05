// SPDX-License-Identifier: Apache-2.0
#include "sim/effects/lens_scatter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <type_traits>
#include <vector>

#include "sim/effects/coarse_halo.h"
#include "sim/effects/half_gaussian.h"
#include "sim/effects/phasors.h"
#include "sim/images/simd.h"

namespace toftwin::sim {
namespace {

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

/// out = kept · in + veil + spread · halo, complex numbers as two floats; the veil as well. `in` may be `out`.
TOFTWIN_SIMD void compose(const float* in, const float* __restrict halo, float kept, float veil_even, float veil_odd,
                          float spread, int count, float* out) {
#pragma GCC ivdep
  for (int i = 0; i < count / 2; ++i) {
    out[2 * i] = kept * in[2 * i] + (veil_even + spread * halo[2 * i]);
    out[2 * i + 1] = kept * in[2 * i + 1] + (veil_odd + spread * halo[2 * i + 1]);
  }
  if (count % 2 != 0) out[count - 1] = kept * in[count - 1] + (veil_even + spread * halo[count - 1]);
}

template <class T>
constexpr int kPartsOf = sizeof(T) / sizeof(float);

template <class T>
const float* floatsOf(const T* values) {
  return reinterpret_cast<const float*>(values);  // a complex number is an array of two
}
template <class T>
float* floatsOf(T* values) {
  return reinterpret_cast<float*>(values);
}

/// An image's scattered light where the halo is wide: what its rows are made of.
class ScatteredImage {
 public:
  template <class T>
  ScatteredImage(const Image<T>& image, const LensScatter& lens)
      : halo_(floatsOf(image.pixels().data()), image.width(), image.height(), kPartsOf<T>, lens.halo_radius),
        kept_(static_cast<float>(1.0 - lens.veil - lens.halo)),
        spread_(static_cast<float>(lens.halo)),
        count_(image.width() * kPartsOf<T>) {
    const double share = lens.veil / static_cast<double>(std::max<std::size_t>(image.size(), 1));
    for (std::size_t part = 0; part < 2; ++part)
      veil_[part] = static_cast<float>(halo_.sum()[part % static_cast<std::size_t>(kPartsOf<T>)] * share);
  }

  /// Row y from the same of the image, which may be the same memory. `room` is for the halo.
  void row(int y, const float* image, std::vector<float>& room, float* out) const {
    room.resize(static_cast<std::size_t>(count_));
    halo_.row(y, room.data());
    compose(image, room.data(), kept_, veil_[0], veil_[1], spread_, count_, out);
  }

 private:
  CoarseHalo halo_;
  std::array<float, 2> veil_{};
  float kept_, spread_;
  int count_;
};

template <class T, class Sum>
void scatter(Image<T>& image, const LensScatter& lens, Sum sum) {
  if (goesByRows(lens)) {
    const ScatteredImage scattered{image, lens};
    forRows(image.height(), [&](int first, int last) {
      std::vector<float> room;
      for (int y = first; y < last; ++y)
        scattered.row(y, floatsOf(&image(0, y)), room, floatsOf(&image(0, y)));
    });
    return;
  }
  if (lens.veil > 0.0) {
    for (const T& value : image.pixels()) sum += value;
  }
  const auto veil = static_cast<T>(
      sum * (lens.veil / static_cast<double>(std::max<std::size_t>(image.size(), 1))));
  const auto kept = static_cast<float>(1.0 - lens.veil - lens.halo);
  const auto spread = static_cast<float>(lens.halo);
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

bool goesByRows(const LensScatter& lens) {
  return lens.halo > 0.0 && lens.halo_radius >= CoarseHalo::kLeastSigma;
}

struct ScatteredRows::Impl {
  const Light& light;
  std::vector<std::optional<ScatteredImage>> phasors;
  ScatteredImage steady;
  std::optional<ScatteredImage> ambient;  ///< if there is any
};

ScatteredRows::ScatteredRows(const LensScatter& lens, const Light& light, std::span<const Harmonic> seen) {
  auto impl = std::make_unique<Impl>(Impl{light, {}, {light.steady, lens}, {}});
  if (std::ranges::any_of(light.ambient.pixels(), [](float radiance) { return radiance != 0.0F; }))
    impl->ambient.emplace(light.ambient, lens);
  for (std::size_t term = 0; term < light.phasors.size(); ++term) {
    auto& scattered = impl->phasors.emplace_back();
    if (!light.phasors[term].empty() && seen[term] != Harmonic::Unseen) scattered.emplace(light.phasors[term], lens);
  }
  impl_ = std::move(impl);
}
ScatteredRows::~ScatteredRows() = default;

Light ScatteredRows::room(int rows) const {
  const Light& light = impl_->light;
  Light part;
  part.frequencies = light.frequencies;
  part.harmonics = light.harmonics;
  part.error = light.error;
  part.steady = part.ambient = Image<float>{light.width(), rows};
  for (const auto& scattered : impl_->phasors) {
    part.phasors.push_back(scattered ? Image<std::complex<float>>{light.width(), rows}
                                     : Image<std::complex<float>>{});
  }
  return part;
}

void ScatteredRows::write(int top, int rows, std::vector<float>& halo, Light& part) const {
  const Light& light = impl_->light;
  const auto write = [&](const ScatteredImage& scattered, const auto& image, auto& to) {
    for (int y = 0; y < rows; ++y) scattered.row(top + y, floatsOf(&image(0, top + y)), halo, floatsOf(&to(0, y)));
  };
  write(impl_->steady, light.steady, part.steady);
  if (impl_->ambient) write(*impl_->ambient, light.ambient, part.ambient);
  for (std::size_t term = 0; term < part.phasors.size(); ++term) {
    if (impl_->phasors[term]) write(*impl_->phasors[term], light.phasors[term], part.phasors[term]);
  }
}

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
