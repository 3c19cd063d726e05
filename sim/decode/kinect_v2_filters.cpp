// SPDX-License-Identifier: Apache-2.0
// The constants are libfreenect2's (DepthPacketProcessor::Parameters).
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "sim/decode/decode_steps.h"
#include "sim/decode/kinect_v2.h"
#include "sim/images/rows.h"
#include "sim/images/simd.h"

namespace toftwin::sim {
namespace {

constexpr float kFalloff = 1.442695F * 5.0F;
constexpr float kMiddle = 0.1195716F, kBeside = 0.1131098F, kDiagonal = 0.1069973F;

using Row = BilateralRows::Row;
using Sums = BilateralRows::Sums;

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

/// eˣ for x in [−7.3, 0], relative error below 6e-6: (polynomial of x/16)^16, that of the least largest error.
inline float decay(float x) {
  const float t = x * (1.0F / 16.0F);
  float e = 0.0330958486F;
  e = 0.163300961F + t * e;
  e = 0.499443955F + t * e;
  e = 0.999967097F + t * e;
  e = 0.999999679F + t * e;
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

/// Pixels without signal stay as they are.
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

constexpr float kNear_m = 0.050F, kFar_m = 0.030F;

bool hangsBetween(float depth_m, const Surroundings& seen) {
  constexpr float kLargest_m = 0.100F;
  constexpr float kLeastMean = 50.0F, kVariation = 0.05F;
  const float nearer = depth_m - seen.nearest_m, farther = seen.farthest_m - depth_m;
  return nearer > kNear_m && farther > kFar_m && std::max(nearer, farther) > kLargest_m &&
         seen.deviation >= kVariation * std::max(seen.mean, kLeastMean);
}

/// Marks the pixels of a row that edgePixels() may drop: at an edge, or between a nearer and a farther
/// neighbour, whether those count or not.
TOFTWIN_SIMD void markDoubtful(const float* above, const float* here, const float* below, const std::uint8_t* is_edge,
                               int width, std::uint8_t* __restrict marks) {
  for (int x = 1; x < width - 1; ++x) {
    const float depth = here[x];
    float nearest = depth, farthest = depth;
    for (const float* row : {above, here, below}) {
      for (int u = -1; u <= 1; ++u) {
        const float other = row[x + u];
        nearest = (other > 0.0F) & (other < nearest) ? other : nearest;
        farthest = other > farthest ? other : farthest;
      }
    }
    const bool is_between = (depth - nearest > kNear_m) & (farthest - depth > kFar_m);
    marks[x] = (depth == depth) & ((is_edge[x] != 0) | is_between) ? 1 : 0;  // not NaN
  }
}

}  // namespace

BilateralRows::Row::Row(std::size_t width) : re(width), im(width), u(width), v(width), square(width) {}
BilateralRows::Sums::Sums(std::size_t width) : re(width), im(width), weight(width), unlikeness(width) {}

BilateralRows::BilateralRows(const Image<std::complex<float>>& phasors, const Image<std::uint8_t>& flags,
                             float least_amplitude, int first)
    : phasors_(phasors),
      flags_(flags),
      least_square_(least_amplitude * least_amplitude),
      next_(first),
      rows_{Row{columns()}, Row{columns()}, Row{columns()}},
      sums_(columns()) {
  for (int y = std::max(0, first - 1); y <= first; ++y) split(y);
}

void BilateralRows::split(int y) {
  Row& row = rowOf(y);
  splitRow(&phasors_(0, y), columns(), row.re.data(), row.im.data(), row.u.data(), row.v.data(), row.square.data());
  if (flags_.empty()) return;
  const std::uint8_t* flags = &flags_(0, y);
  for (std::size_t x = 0; x < columns(); ++x) {
    if (has(flags[x], PixelFlag::Saturated)) row.re[x] = row.im[x] = row.u[x] = row.v[x] = row.square[x] = 0.0F;
  }
}

void BilateralRows::next(std::complex<float>* filtered, float* unlikeness) {
  const int y = next_++, height = phasors_.height();
  if (y + 1 < height) split(y + 1);
  const Row& own = rowOf(y);
  const std::size_t width = columns();
  const bool is_inside = y > 0 && y + 1 < height && width >= 3;
  for (std::size_t x = 0; x < width; x += is_inside ? width - 1 : 1) {
    filtered[x] = {own.re[x], own.im[x]};
    unlikeness[x] = 0.0F;
  }
  if (!is_inside) return;
  for (std::vector<float>* sum : {&sums_.re, &sums_.im, &sums_.weight, &sums_.unlikeness})
    std::fill(sum->begin(), sum->end(), 0.0F);
  for (int shift : {-1, 0, 1}) {
    const float gauss = shift == 0 ? kBeside : kDiagonal;
    addNeighbour(own, rowOf(y - 1), shift, gauss, least_square_, sums_);
    if (shift != 0) addNeighbour(own, own, shift, kBeside, least_square_, sums_);
    addNeighbour(own, rowOf(y + 1), shift, gauss, least_square_, sums_);
  }
  finishRow(own, sums_, filtered, unlikeness);
}

FilteredPhasors bilateralFilter(const Image<std::complex<float>>& phasors, float least_amplitude) {
  const int width = phasors.width(), height = phasors.height();
  FilteredPhasors result{Image<std::complex<float>>{width, height}, Image<float>{width, height}};
  const Image<std::uint8_t> no_flags;
  forRows(height, [&](int first, int last) {
    BilateralRows rows{phasors, no_flags, least_amplitude, first};
    for (int y = first; y < last; ++y) rows.next(&result.phasors(0, y), &result.unlikeness(0, y));
  });
  return result;
}

namespace {

bool isDropped(const Image<float>& depth_m, const Image<std::uint8_t>& is_edge, const Image<float>& brightness,
               int x, int y) {
  return is_edge(x, y) != 0 || hangsBetween(depth_m(x, y), lookAround(depth_m, is_edge, brightness, x, y));
}

}  // namespace

void findDropped(const Image<float>& depth_m, const Image<std::uint8_t>& is_edge, const Image<float>& brightness,
                 int y, std::uint8_t* drops) {
  const int width = depth_m.width();
  std::fill_n(drops, width, std::uint8_t{0});
  if (width < 3 || y < 1 || y + 1 >= depth_m.height()) return;
  markDoubtful(&depth_m(0, y - 1), &depth_m(0, y), &depth_m(0, y + 1), &is_edge(0, y), width, drops);
  for (int x = 1; x < width - 1; ++x) {
    if (drops[x] != 0 && !isDropped(depth_m, is_edge, brightness, x, y)) drops[x] = 0;
  }
}

Image<std::uint8_t> edgePixels(const Image<float>& depth_m, const Image<std::uint8_t>& is_edge,
                               const Image<float>& brightness) {
  Image<std::uint8_t> drops{depth_m.width(), depth_m.height()};
  forRows(drops.height(), [&](int first, int last) {
    for (int y = first; y < last; ++y) findDropped(depth_m, is_edge, brightness, y, &drops(0, y));
  });
  return drops;
}

}  // namespace toftwin::sim
