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

/// How unlike pixels are, (1 − cos Δφ)/2, and what is left of a neighbour's weight for that: the same both ways.
struct Pairs {
  explicit Pairs(std::size_t width) : distance(width), decayed(width) {}
  std::vector<float> distance, decayed;
};

/// Pixel x of one row and pixel x of another, from their directions.
TOFTWIN_SIMD void compare(const float* __restrict u, const float* __restrict v, const float* __restrict other_u,
                          const float* __restrict other_v, std::size_t count, float* __restrict distance,
                          float* __restrict decayed) {
  for (std::size_t x = 0; x < count; ++x) {
    distance[x] = 0.5F * (1.0F - (u[x] * other_u[x] + v[x] * other_v[x]));
    decayed[x] = decay(-kFalloff * distance[x]);
  }
}

/// One neighbour of all pixels of a row: numbers of the pixel x of it at x.
struct Neighbour {
  const float *re, *im, *square, *distance, *decayed;
  float gauss;
};

/// The filtered row without its ends, and the unlikeness of its pixels.
TOFTWIN_SIMD void filterRow(const Row& own, const Neighbour* neighbours, float least_square,
                            std::complex<float>* phasors, float* __restrict unlikeness) {
  constexpr int kCount = 8;
  Neighbour n[kCount];
  for (int i = 0; i < kCount; ++i) n[i] = neighbours[i];
  auto* __restrict parts = reinterpret_cast<float*>(phasors);
  const float *own_re = own.re.data(), *own_im = own.im.data(), *square = own.square.data();
  const std::size_t last = own.re.size() - 1;
#pragma GCC ivdep
  for (std::size_t x = 1; x < last; ++x) {
    const bool is_strong = square[x] >= least_square;
    const float threshold = is_strong ? least_square : 0.0F;
    float re = 0.0F, im = 0.0F, total = 0.0F, unlike = 0.0F;
#pragma GCC unroll 8
    for (int i = 0; i < kCount; ++i) {
      // All are read, whether they count or not: what is read on a condition does not become vector code.
      const float other = n[i].square[x], other_re = n[i].re[x], other_im = n[i].im[x];
      const float distance = n[i].distance[x], decayed = n[i].decayed[x];
      const bool counts = (other >= threshold) & (other > 0.0F);
      const float like = is_strong ? decayed : 1.0F;  // in a weak pixel all count alike
      const float weight = counts ? n[i].gauss * like : 0.0F;
      re += counts ? weight * other_re : 0.0F;
      im += counts ? weight * other_im : 0.0F;
      total += weight;
      unlike += counts ? distance : 0.0F;
    }
    const bool is_signal = square[x] > 0.0F;  // not NaN
    const float per_weight = 1.0F / (total + kMiddle), mine_re = own_re[x], mine_im = own_im[x];
    parts[2 * x] = is_signal ? (re + kMiddle * mine_re) * per_weight : mine_re;
    parts[2 * x + 1] = is_signal ? (im + kMiddle * mine_im) * per_weight : mine_im;
    unlikeness[x] = is_signal ? unlike : 0.0F;
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
  constexpr float kLeastMean = 50.0F, kVariation = 0.05F, kNinth = 1.0F / 9.0F;
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
        mean += bright[row][column];
      }
    }
    mean *= kNinth;
#pragma GCC unroll 3
    for (int row = 0; row < 3; ++row) {
#pragma GCC unroll 3
      for (std::size_t column = x - 1; column <= x + 1; ++column) {
        const float off = bright[row][column] - mean;
        square += off * off;
      }
    }
    const float nearer = here - nearest, farther = farthest - here,
                larger = nearer > farther ? nearer : farther;
    const float enough = kVariation * (mean < kLeastMean ? kLeastMean : mean);
    const bool hangs =
        (nearer > kNear_m) & (farther > kFar_m) & (larger > kLargest_m) & (square * kNinth >= enough * enough);
    drops[x] = (here == here) & ((is_edge[x] != 0) | hangs) ? 1 : 0;  // not NaN
  }
}

}  // namespace

class BilateralRows::Impl {
 public:
  Impl(const Image<std::complex<float>>& phasors, float least_amplitude, const Image<std::uint8_t>& flags)
      : phasors_(phasors),
        flags_(flags),
        columns_(static_cast<std::size_t>(phasors.width())),
        least_square_(least_amplitude * least_amplitude),
        along_(columns_) {
    rows_.fill(Row{columns_});
    down_.fill({Pairs{columns_}, Pairs{columns_}, Pairs{columns_}});
  }

  void row(int y, std::complex<float>* phasors, float* unlikeness) {
    if (y != last_ + 1) {
      split(y - 1);
      split(y);
    }
    split(y + 1);
    last_ = y;
    const Row& own = place(y);
    for (const std::size_t x : {std::size_t{0}, columns_ - 1}) {
      phasors[x] = {own.re[x], own.im[x]};
      unlikeness[x] = 0.0F;
    }
    if (y == 0 || y == phasors_.height() - 1 || columns_ < 3) {
      for (std::size_t x = 0; x < columns_; ++x) phasors[x] = {own.re[x], own.im[x]};
      std::fill_n(unlikeness, columns_, 0.0F);
      return;
    }
    compare(own.u.data(), own.v.data(), &own.u[1], &own.v[1], columns_ - 1, along_.distance.data(),
            along_.decayed.data());
    std::array<Neighbour, 8> neighbours;
    auto* next = neighbours.data();
    for (int shift : {-1, 0, 1}) {
      *next++ = vertical(place(y - 1), shift, down_[parity(y - 1)][index(-shift)], shift);
      if (shift != 0) *next++ = neighbour(own, shift, along_, shift < 0 ? -1 : 0, kBeside);
      *next++ = vertical(place(y + 1), shift, down_[parity(y)][index(shift)], 0);
    }
    filterRow(own, neighbours.data(), least_square_, phasors, unlikeness);
  }

 private:
  Row& place(int y) { return rows_[static_cast<std::size_t>((y + 3) % 3)]; }
  static std::size_t parity(int y) { return static_cast<std::size_t>(y & 1); }
  static std::size_t index(int shift) { return static_cast<std::size_t>(shift + 1); }

  /// The pixels `shift` to the right in `other`, whose pairs with ours lie `at` further on.
  static Neighbour neighbour(const Row& other, int shift, const Pairs& pairs, int at, float gauss) {
    return {other.re.data() + shift, other.im.data() + shift,     other.square.data() + shift,
            pairs.distance.data() + at, pairs.decayed.data() + at, gauss};
  }
  static Neighbour vertical(const Row& other, int shift, const Pairs& pairs, int at) {
    return neighbour(other, shift, pairs, at, shift == 0 ? kBeside : kDiagonal);
  }

  /// Reads a row, and compares it with the one above if that was read before.
  void split(int y) {
    if (y < 0 || y >= phasors_.height()) return;
    Row& row = place(y);
    splitRow(&phasors_(0, y), flags_.empty() ? nullptr : &flags_(0, y), columns_, row.re.data(), row.im.data(),
             row.u.data(), row.v.data(), row.square.data());
    if (y == 0 || columns_ < 3) return;
    const Row& above = place(y - 1);
    for (int shift : {-1, 0, 1}) {
      Pairs& pairs = down_[parity(y - 1)][index(shift)];
      const std::size_t first = shift < 0 ? 1 : 0, other = shift > 0 ? 1 : 0;
      compare(&above.u[first], &above.v[first], &row.u[other], &row.v[other], columns_ - first - other,
              &pairs.distance[first], &pairs.decayed[first]);
    }
  }

  const Image<std::complex<float>>& phasors_;
  const Image<std::uint8_t>& flags_;
  std::size_t columns_;
  float least_square_;
  std::array<Row, 3> rows_{Row{0}, Row{0}, Row{0}};  ///< y − 1, y, y + 1, in turns
  /// Pixels x of an even row, of an odd one, with pixels x − 1, x and x + 1 of the next.
  std::array<std::array<Pairs, 3>, 2> down_{{{Pairs{0}, Pairs{0}, Pairs{0}}, {Pairs{0}, Pairs{0}, Pairs{0}}}};
  Pairs along_;      ///< pixels x and x + 1
  int last_ = -9;  ///< row that was asked for
};

BilateralRows::BilateralRows(const Image<std::complex<float>>& phasors, float least_amplitude,
                             const Image<std::uint8_t>& flags)
    : impl_(std::make_unique<Impl>(phasors, least_amplitude, flags)) {}
BilateralRows::BilateralRows(BilateralRows&&) noexcept = default;
BilateralRows::~BilateralRows() = default;
void BilateralRows::row(int y, std::complex<float>* phasors, float* unlikeness) { impl_->row(y, phasors, unlikeness); }

FilteredPhasors bilateralFilter(const Image<std::complex<float>>& phasors, float least_amplitude,
                                const Image<std::uint8_t>& flags) {
  const int width = phasors.width(), height = phasors.height();
  FilteredPhasors result{Image<std::complex<float>>{width, height}, Image<float>{width, height}};
  forRows(height, [&](int first, int last) {
    BilateralRows rows{phasors, least_amplitude, flags};
    for (int y = first; y < last; ++y) rows.row(y, &result.phasors(0, y), &result.unlikeness(0, y));
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
