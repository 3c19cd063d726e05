// SPDX-License-Identifier: Apache-2.0
// The constants are libfreenect2's (DepthPacketProcessor::Parameters).
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

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

TOFTWIN_SIMD void splitRow(const std::complex<float>* phasors, std::size_t width, float* __restrict re,
                           float* __restrict im, float* __restrict u, float* __restrict v,
                           float* __restrict square) {
  const auto* parts = reinterpret_cast<const float*>(phasors);
  for (std::size_t x = 0; x < width; ++x) {
    const float a = parts[2 * x], b = parts[2 * x + 1];
    const float s = a * a + b * b;
    const float inverse = s > 0.0F ? 1.0F / __builtin_sqrtf(s) : 0.0F;  // NaN: no signal
    re[x] = a;
    im[x] = b;
    u[x] = a * inverse;
    v[x] = b * inverse;
    square[x] = s;
  }
}

void split(const Image<std::complex<float>>& phasors, int y, Row& row) {
  splitRow(&phasors(0, y), row.re.size(), row.re.data(), row.im.data(), row.u.data(), row.v.data(),
           row.square.data());
}

/// What is gathered for one row of the result.
struct Sums {
  explicit Sums(std::size_t width) : re(width), im(width), weight(width), unlikeness(width) {}
  std::vector<float> re, im, weight, unlikeness;
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
    parts[2 * x] = is_signal ? (re[x] + kMiddle * own_re[x]) * weight : parts[2 * x];
    parts[2 * x + 1] = is_signal ? (im[x] + kMiddle * own_im[x]) * weight : parts[2 * x + 1];
    unlikeness[x] = is_signal ? unlike[x] : unlikeness[x];
  }
}

/// What a pixel's surroundings say to the edge filter.
struct Surroundings {
  float nearest_m, farthest_m;
  float mean, deviation;  ///< of the brightness over the nine pixels
};

Surroundings lookAround(const Image<float>& depth_m, const Image<std::uint8_t>& is_edge,
                        const Image<float>& brightness, int x, int y) {
  Surroundings seen{depth_m(x, y), depth_m(x, y), 0.0F, 0.0F};
  std::array<float, 9> values{};
  std::size_t n = 0;
  for (int v = y - 1; v <= y + 1; ++v) {
    for (int u = x - 1; u <= x + 1; ++u) {
      seen.mean += brightness(u, v) / 9.0F;
      values[n++] = brightness(u, v);
      const float depth = depth_m(u, v);
      if (is_edge(u, v) != 0 || !(depth > 0.0F)) continue;
      seen.nearest_m = std::min(seen.nearest_m, depth);
      seen.farthest_m = std::max(seen.farthest_m, depth);
    }
  }
  for (float value : values) seen.deviation += (value - seen.mean) * (value - seen.mean) / 9.0F;
  seen.deviation = std::sqrt(seen.deviation);
  return seen;
}

bool hangsBetween(float depth_m, const Surroundings& seen) {
  constexpr float kNear_m = 0.050F, kFar_m = 0.030F, kLargest_m = 0.100F;
  constexpr float kLeastMean = 50.0F, kVariation = 0.05F;
  const float nearer = depth_m - seen.nearest_m, farther = seen.farthest_m - depth_m;
  return nearer > kNear_m && farther > kFar_m && std::max(nearer, farther) > kLargest_m &&
         seen.deviation >= kVariation * std::max(seen.mean, kLeastMean);
}

}  // namespace

FilteredPhasors bilateralFilter(const Image<std::complex<float>>& phasors, float least_amplitude) {
  const int width = phasors.width(), height = phasors.height();
  FilteredPhasors result{phasors, Image<float>{width, height}};
  if (width < 3 || height < 3) return result;
  const float least_square = least_amplitude * least_amplitude;
  forRows(height - 2, [&](int first, int last) {
    const auto columns = static_cast<std::size_t>(width);
    std::array<Row, 3> rows{Row{columns}, Row{columns}, Row{columns}};  // y − 1, y, y + 1, in turns
    split(phasors, first, rows[0]);
    split(phasors, first + 1, rows[1]);
    for (int y = first + 1; y <= last; ++y) {
      const auto place = [&](int row) -> Row& {
        return rows[static_cast<std::size_t>((row - first) % 3)];
      };
      split(phasors, y + 1, place(y + 1));
      const Row &above = place(y - 1), &own = place(y), &below = place(y + 1);
      Sums sums{columns};
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
    for (int y = first + 1; y <= last; ++y) {
      for (int x = 1; x < width - 1; ++x) {
        if (std::isnan(depth_m(x, y))) continue;
        if (is_edge(x, y) != 0 ||
            hangsBetween(depth_m(x, y), lookAround(depth_m, is_edge, brightness, x, y))) {
          drops(x, y) = 1;
        }
      }
    }
  });
  return drops;
}

}  // namespace toftwin::sim
