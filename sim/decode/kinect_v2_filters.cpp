// SPDX-License-Identifier: Apache-2.0
// The constants are libfreenect2's (DepthPacketProcessor::Parameters).
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <toftwin/frame.h>
#include <toftwin/nan.h>

#include "sim/decode/kinect_v2.h"
#include "sim/images/rows.h"
#include "sim/images/simd.h"

namespace toftwin::sim {
namespace {

constexpr float kFalloff = 1.442695F * 5.0F;
constexpr float kMiddle = 0.1195716F, kBeside = 0.1131098F, kDiagonal = 0.1069973F;

/// One row of phasors as separate arrays: the phasor, its direction, its squared length.
struct Row {
  explicit Row(std::size_t width) : re(width), im(width), u(width), v(width), square(width) {}
  std::vector<float> re, im, u, v, square;
};

/// `flags` may be null.
TOFTWIN_SIMD void splitRow(const std::complex<float>* phasors, const std::uint8_t* flags, std::size_t width,
                           float* __restrict re, float* __restrict im, float* __restrict u,
                           float* __restrict v, float* __restrict square) {
  const auto* parts = reinterpret_cast<const float*>(phasors);
  for (std::size_t x = 0; x < width; ++x) {
    re[x] = parts[2 * x];
    im[x] = parts[2 * x + 1];
  }
  if (flags != nullptr) {
    constexpr auto kSaturated = static_cast<std::uint8_t>(PixelFlag::Saturated);
    for (std::size_t x = 0; x < width; ++x) {
      const bool is_full = (flags[x] & kSaturated) != 0;
      re[x] = is_full ? 0.0F : re[x];
      im[x] = is_full ? 0.0F : im[x];
    }
  }
  for (std::size_t x = 0; x < width; ++x) {
    const float a = re[x], b = im[x];
    const float s = a * a + b * b;
    const float inverse = s > 0.0F ? 1.0F / __builtin_sqrtf(s) : 0.0F;  // NaN: no signal
    u[x] = a * inverse;
    v[x] = b * inverse;
    square[x] = s;
  }
}

/// What is gathered for one row of the result.
struct Sums {
  explicit Sums(std::size_t width) : re(width), im(width), weight(width), unlikeness(width) {}
  std::vector<float> re, im, weight, unlikeness;

  void clear() {
    for (auto* sum : {&re, &im, &weight, &unlikeness}) std::fill(sum->begin(), sum->end(), 0.0F);
  }
};

/// eˣ for x in [−7.3, 0], relative error below 2e-5: (Taylor series of x/16)^16.
inline float decay(float x) {
  const float t = x * (1.0F / 16.0F);
  float e = 1.0F + t * (1.0F / 6.0F);
  e = 1.0F + t * (1.0F / 5.0F) * e;
  e = 1.0F + t * (1.0F / 4.0F) * e;
  e = 1.0F + t * (1.0F / 3.0F) * e;
  e = 1.0F + t * (1.0F / 2.0F) * e;
  e = 1.0F + t * e;
  e *= e;
  e *= e;
  e *= e;
  return e * e;
}

/// Adds the neighbour `shift` pixels to the right in row `other` to all inner pixels of `own`.
TOFTWIN_SIMD void addNeighbour(const Row& own, const Row& other, int shift, float gauss,
                               float least_square, Sums& sums) {
  const std::size_t inner = own.re.size() - 2;
  const float *u = &own.u[1], *v = &own.v[1], *square = &own.square[1];
  const auto at = static_cast<std::size_t>(1 + shift);
  const float *other_re = &other.re[at], *other_im = &other.im[at], *other_u = &other.u[at],
              *other_v = &other.v[at], *other_square = &other.square[at];
  float *re = &sums.re[1], *im = &sums.im[1], *total = &sums.weight[1],
        *unlikeness = &sums.unlikeness[1];
#pragma GCC ivdep
  for (std::size_t x = 0; x < inner; ++x) {
    const bool is_strong = square[x] >= least_square;
    const float threshold = is_strong ? least_square : 0.0F;
    const float falloff = is_strong ? kFalloff : 0.0F;
    const float distance = 0.5F * (1.0F - (u[x] * other_u[x] + v[x] * other_v[x]));
    const bool counts = (other_square[x] >= threshold) & (other_square[x] > 0.0F);
    const float weight = counts ? gauss * decay(-falloff * distance) : 0.0F;
    re[x] += counts ? weight * other_re[x] : 0.0F;
    im[x] += counts ? weight * other_im[x] : 0.0F;
    total[x] += weight;
    unlikeness[x] += counts ? distance : 0.0F;
  }
}

/// The filtered row; its ends stay as they are.
TOFTWIN_SIMD void finishRow(const Row& own, const Sums& sums, std::complex<float>* phasors,
                            float* __restrict unlikeness) {
  auto* __restrict parts = reinterpret_cast<float*>(phasors);
  const float *square = own.square.data(), *own_re = own.re.data(), *own_im = own.im.data();
  const float *re = sums.re.data(), *im = sums.im.data(), *total = sums.weight.data();
  const float* unlike = sums.unlikeness.data();
  const std::size_t last = own.re.size() - 1;
  for (std::size_t x = 1; x < last; ++x) {
    const bool is_signal = square[x] > 0.0F;  // not NaN
    const float weight = 1.0F / (total[x] + kMiddle);
    parts[2 * x] = is_signal ? (re[x] + kMiddle * own_re[x]) * weight : own_re[x];
    parts[2 * x + 1] = is_signal ? (im[x] + kMiddle * own_im[x]) * weight : own_im[x];
    unlikeness[x] = is_signal ? unlike[x] : 0.0F;
  }
  for (const std::size_t x : {std::size_t{0}, last}) {
    parts[2 * x] = own_re[x];
    parts[2 * x + 1] = own_im[x];
  }
}

/// What the edge filter looks at in one row: brightness, and depths that count (NaN: they do not).
struct EdgeRow {
  explicit EdgeRow(std::size_t width) : depth_m(width) {}
  const float* brightness = nullptr;
  std::vector<float> depth_m;
};

TOFTWIN_SIMD void takeDepths(const float* __restrict depth_m, const std::uint8_t* __restrict is_edge,
                             std::size_t width, float* __restrict counts) {
  for (std::size_t x = 0; x < width; ++x)
    counts[x] = (is_edge[x] == 0) & (depth_m[x] > 0.0F) ? depth_m[x] : kNaN;
}

/// The inner pixels of a row that are at an edge or hang between two surfaces.
TOFTWIN_SIMD void dropRow(const EdgeRow& above, const EdgeRow& own, const EdgeRow& below,
                          const float* __restrict depth_m, const std::uint8_t* __restrict is_edge,
                          std::uint8_t* __restrict drops) {
  constexpr float kNear_m = 0.050F, kFar_m = 0.030F, kLargest_m = 0.100F;
  constexpr float kLeastMean = 50.0F, kVariation = 0.05F;
  const float* depths[] = {above.depth_m.data(), own.depth_m.data(), below.depth_m.data()};
  const float* bright[] = {above.brightness, own.brightness, below.brightness};
  const std::size_t last = own.depth_m.size() - 1;
  for (std::size_t x = 1; x < last; ++x) {
    const float here = depth_m[x];
    float nearest = here, farthest = here, mean = 0.0F, square = 0.0F;
#pragma GCC unroll 3
    for (int row = 0; row < 3; ++row) {
#pragma GCC unroll 3
      for (std::size_t column = x - 1; column <= x + 1; ++column) {
        const float depth = depths[row][column];
        nearest = depth < nearest ? depth : nearest;  // not NaN
        farthest = depth > farthest ? depth : farthest;
        mean += bright[row][column] / 9.0F;
      }
    }
#pragma GCC unroll 3
    for (int row = 0; row < 3; ++row) {
#pragma GCC unroll 3
      for (std::size_t column = x - 1; column <= x + 1; ++column) {
        const float off = bright[row][column] - mean;
        square += off * off / 9.0F;
      }
    }
    const float nearer = here - nearest, farther = farthest - here,
                larger = nearer > farther ? nearer : farther;
    const float enough = kVariation * (mean < kLeastMean ? kLeastMean : mean);
    const bool hangs =
        (nearer > kNear_m) & (farther > kFar_m) & (larger > kLargest_m) & (__builtin_sqrtf(square) >= enough);
    drops[x] = (here == here) & ((is_edge[x] != 0) | hangs) ? 1 : 0;  // not NaN
  }
}

}  // namespace

FilteredPhasors bilateralFilter(const Image<std::complex<float>>& phasors, float least_amplitude,
                                const Image<std::uint8_t>& flags) {
  const int width = phasors.width(), height = phasors.height();
  FilteredPhasors result{Image<std::complex<float>>{width, height}, Image<float>{width, height}};
  const float least_square = least_amplitude * least_amplitude;
  forRows(height, [&](int first, int last) {
    const auto columns = static_cast<std::size_t>(width);
    std::array<Row, 3> rows{Row{columns}, Row{columns}, Row{columns}};  // y − 1, y, y + 1, in turns
    const auto place = [&](int y) -> Row& { return rows[static_cast<std::size_t>((y + 3) % 3)]; };
    const auto split = [&](int y) {
      Row& row = place(y);
      if (y >= 0 && y < height)
        splitRow(&phasors(0, y), flags.empty() ? nullptr : &flags(0, y), columns, row.re.data(),
                 row.im.data(), row.u.data(), row.v.data(), row.square.data());
    };
    split(first - 1);
    split(first);
    Sums sums{columns};
    for (int y = first; y < last; ++y) {
      split(y + 1);
      const Row& own = place(y);
      if (y == 0 || y == height - 1 || width < 3) {
        for (std::size_t x = 0; x < columns; ++x)
          result.phasors(static_cast<int>(x), y) = {own.re[x], own.im[x]};
        continue;
      }
      const Row &above = place(y - 1), &below = place(y + 1);
      sums.clear();
      for (int shift : {-1, 0, 1}) {
        const float gauss = shift == 0 ? kBeside : kDiagonal;
        addNeighbour(own, above, shift, gauss, least_square, sums);
        if (shift != 0) addNeighbour(own, own, shift, kBeside, least_square, sums);
        addNeighbour(own, below, shift, gauss, least_square, sums);
      }
      finishRow(own, sums, &result.phasors(0, y), &result.unlikeness(0, y));
    }
  });
  return result;
}

Image<std::uint8_t> edgePixels(const Image<float>& depth_m, const Image<std::uint8_t>& is_edge,
                               const Image<float>& brightness) {
  const int width = depth_m.width(), height = depth_m.height();
  Image<std::uint8_t> drops{width, height};
  if (width < 3 || height < 3) return drops;
  forRows(height - 2, [&](int first, int last) {
    const auto columns = static_cast<std::size_t>(width);
    std::array<EdgeRow, 3> rows{EdgeRow{columns}, EdgeRow{columns}, EdgeRow{columns}};
    const auto take = [&](int y) -> EdgeRow& {
      EdgeRow& row = rows[static_cast<std::size_t>(y % 3)];
      takeDepths(&depth_m(0, y), &is_edge(0, y), columns, row.depth_m.data());
      row.brightness = &brightness(0, y);
      return row;
    };
    take(first);
    take(first + 1);
    for (int y = first + 1; y <= last; ++y) {
      const EdgeRow& below = take(y + 1);
      dropRow(rows[static_cast<std::size_t>((y - 1) % 3)], rows[static_cast<std::size_t>(y % 3)], below,
              &depth_m(0, y), &is_edge(0, y), &drops(0, y));
    }
  });
  return drops;
}

}  // namespace toftwin::sim
